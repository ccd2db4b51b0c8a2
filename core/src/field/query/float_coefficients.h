#pragma once
// Conversion of coefficients between double, in which they are computed, and float, in which they are stored.

#include "hpsdf/detail/field_data.h"

namespace hpsdf::query {

/// The change of a field when its coefficients are rounded to float, in units of length.
struct Rounding {
  double rms = 0;
  double max = 0;  ///< upper bound of the change at any point
};

/// Computes by how much rounding the coefficients to float changes a field. The coefficients of the field are
/// double.
Rounding floatRounding(const FieldData& field);

/// Convert the coefficients of a field to float or to double. Coefficients that already have that type do not
/// change.
void toFloat(FieldData& field);
void toDouble(FieldData& field);

/// Returns true if every vertex of the exact leaves is equal to a vertex of three floats.
bool hasFloatVertices(const ExactTriangles& exact);
/// Rounds the vertices of the exact leaves to float.
void roundVertices(ExactTriangles& exact);

}  // namespace hpsdf::query
