#pragma once
// The winding number without a hierarchy, for comparison.

#include <numbers>

#include "hpsdf/triangle_mesh.h"
#include "sign/solid_angle.h"

namespace hpsdf::support {

/// Returns the winding number as the sum of the solid angles of all triangles.
inline double windingByHand(const TriangleMesh& mesh, const Vector3& x) {
  double sum = 0;
  for (const Triangle& triangle : mesh.triangles) {
    const auto [a, b, c] = cornersOf(mesh, triangle);
    sign::AngleSum half;
    sign::addHalfSolidAngle(a - x, b - x, c - x, half);
    sum += half.value();
  }
  return sum / (2 * std::numbers::pi);
}

}  // namespace hpsdf::support
