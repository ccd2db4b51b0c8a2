#pragma once

#include <pybind11/pybind11.h>

#include <memory>

#include "hpsdf/field.h"

namespace hpsdf::python {

using FieldClass = pybind11::class_<Field, std::shared_ptr<Field>>;

FieldClass addField(pybind11::module_& module);

}  // namespace hpsdf::python
