#pragma once
// Conversion of coefficients between double, in which they are computed, and float, in which they are stored.

#include "hpsdf/detail/field_data.h"

namespace hpsdf::query {

/// The change of a field when its coefficients are rounded to float, in units of length.
struct Rounding {
  double rms = 0;
  double max = 0;  ///< bound of the change anywhere
};

/// Computes the rounding of a field whose coefficients are double.
Rounding floatRounding(const FieldData& field);

/// Converts the coefficients; leaves coefficients of the wanted type as they are.
void toFloat(FieldData& field);
void toDouble(FieldData& field);

}  // namespace hpsdf::query
