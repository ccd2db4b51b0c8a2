#pragma once
// Conversion of coefficients between double, in which they are computed, and the precisions in which they are stored.

#include <cstdint>
#include <span>

#include "hpsdf/detail/field_data.h"
#include "util/across_parts.h"

namespace hpsdf::query {

/// The change of a field when its coefficients, and the vertices of its exact leaves, are rounded to float, in units of
/// length.
struct Rounding {
  double rms = 0;
  double max = 0;  ///< upper bound of the change at any point
};

/// Returns the greatest distance by which `roundVertices` moves a vertex.
double vertexRounding(const ExactTriangles& exact);

/// Computes by how much rounding to float changes a field. The coefficients of the field are double. A vertex that
/// moves by δ changes no distance by more than δ; in `rms`, all exact leaves count with the greatest such δ.
/// `parts` are those of a field of which `field` is one; the result is that of the whole field.
Rounding floatRounding(const FieldData& field, const detail::AcrossParts& parts = {});

/// Computes by how much a field with double coefficients differs from the same field with these nodes and coefficients.
Rounding quantizedRounding(const FieldData& field, std::span<const std::uint64_t> nodes,
                           const QuantizedCoefficients& coefficients, const detail::AcrossParts& parts = {});

/// Convert the coefficients of a field from double to float, or from any type to double. Other coefficients do not
/// change.
void toFloat(FieldData& field);
void toDouble(FieldData& field);

/// Round a number or a vertex to float and back. The conversions are not inlined: where GCC 12 vectorizes both for two
/// coordinates of a vector, it leaves them out.
[[gnu::noinline]] double throughFloat(double number);
Vector3 throughFloat(const Vector3& vertex);

/// Returns true if every vertex of the exact leaves is equal to a vertex of three floats.
bool hasFloatVertices(const ExactTriangles& exact);
/// Returns true if no triangle of the exact leaves turns when its vertices are rounded to float. The sign of a distance
/// comes from the normals of triangles, so that it would be wrong beside a triangle that turned.
bool mayRoundVertices(const ExactTriangles& exact);
/// Rounds the vertices of the exact leaves to float, unless a triangle would turn.
void roundVertices(ExactTriangles& exact);

}  // namespace hpsdf::query
