#pragma once
// Coefficients in double, in which they are computed, and in float, in which they are kept.

#include "hpsdf/detail/field_data.h"

namespace hpsdf {

/// The field's change by keeping its coefficients, which are in double, as float.
struct Rounding {
  double rms = 0;
  double most = 0;  ///< nowhere more
};
Rounding roundingOf(const FieldData& field);

/// Without effect on coefficients that are of that type already.
void toFloat(FieldData& field);
void toDouble(FieldData& field);

}  // namespace hpsdf
