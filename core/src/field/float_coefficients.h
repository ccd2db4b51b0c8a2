#pragma once
// Coefficients in double, in which they are computed, and in float, in which they are kept.

#include "hpsdf/field.h"

namespace hpsdf {

/// RMS change of the field by keeping its coefficients, which are in double, as float.
double rmsOfRounding(const FieldData& field);

/// Without effect on coefficients that are of that type already.
void toFloat(FieldData& field);
void toDouble(FieldData& field);

}  // namespace hpsdf
