#pragma once
// Evaluation of exact leaves: the signed distance to the nearest of a list of triangles.

#include <array>
#include <cstdint>
#include <span>

#include "hpsdf/detail/field_data.h"

namespace hpsdf::query {

/// The value and the gradient of a result with a Hessian. With these two functions, code that adds a Hessian leaves
/// value and gradient to the code for `ValueAndGradient`, so that they are the same to the bit.
inline ValueAndGradient firstDerivatives(const ValueGradientHessian& result) { return {result.value, result.gradient}; }
inline void setFirstDerivatives(ValueGradientHessian& result, const ValueAndGradient& first) {
  result.value = first.value;
  result.gradient = first.gradient;
}

/// Returns the octant, numbered like the children of a cell, of a point with these local coordinates.
inline int octantOf(const std::array<double, 3>& local) {
  return static_cast<int>(local[0] >= 0) | static_cast<int>(local[1] >= 0) << 1 | static_cast<int>(local[2] >= 0) << 2;
}

/// Computes the signed distances from points to the nearest of the triangles of an exact leaf. `leaf` is the packed
/// node. All points must lie in the same octant of the leaf (`octantOf`); a point on the plane between two octants lies
/// in both. The other overloads also give the gradients, and the Hessians. On the surface, where the distance is 0, the
/// gradient is the unit pseudonormal and the Hessian is 0. The results depend neither on the instruction set nor on the
/// number of points. Several points are faster than one if they lie close to each other.
void evaluateExact(const ExactTriangles& exact, std::uint64_t leaf, int octant, std::span<const Vector3> points,
                   double* out);
void evaluateExact(const ExactTriangles& exact, std::uint64_t leaf, int octant, std::span<const Vector3> points,
                   ValueAndGradient* out);
void evaluateExact(const ExactTriangles& exact, std::uint64_t leaf, int octant, std::span<const Vector3> points,
                   ValueGradientHessian* out);

/// Returns the greatest ratio of l² to |n| of an exact leaf's triangles with the longest side l and the normal n = (b −
/// a) × (c − a), and at least 1. Triangles without area do not count. The computed n has an error of about ε·l², so
/// that the distance to the plane through a vertex at the distance r has an error of about ε·r·l²/|n|.
double thinness(const ExactTriangles& exact, std::uint64_t leaf);

}  // namespace hpsdf::query
