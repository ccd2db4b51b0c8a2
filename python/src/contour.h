#pragma once

#include "field.h"

namespace hpsdf::python {

/// Adds the method `contour` to the class of fields.
void addContour(FieldClass& fields);

}  // namespace hpsdf::python
