#pragma once
// Fields of which tests make contours, and points at which they measure these.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field.h"
#include "hpsdf/shapes.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::support {

inline Box cubeOf(double half = 1) { return Box(Vector3::Constant(-half), Vector3::Constant(half)); }

inline double torus(const Vector3& x) { return std::hypot(std::hypot(x.x(), x.y()) - 0.6, x.z()) - 0.25; }

inline const Field& torusField() {
  static const Field field = build(torus, cubeOf(), {.targetError = 1e-9});
  return field;
}

/// Returns the field of a built-in shape, with exact leaves near the surface.
inline Field exactField(const std::string& shape) {
  const ExactDistance distance(shapes::mesh(shape));
  const Box box = distance.source().box;
  const Vector3 margin = 0.1 * box.sizes();
  return build(distance, Box(Vector3(box.min() - margin), Vector3(box.max() + margin)),
               {.targetError = 1e-6, .strategy = Strategy::hpx});
}

/// Returns the vertices of a mesh, and points of a lattice in each of its triangles, with so many intervals along each
/// side.
inline std::vector<Vector3> pointsOf(const TriangleMesh& mesh, int along) {
  std::vector<Vector3> points = mesh.vertices;
  for (const Triangle& triangle : mesh.triangles) {
    const auto [a, b, c] = cornersOf(mesh, triangle);
    for (int i = 0; i <= along; ++i)
      for (int k = 0; i + k <= along; ++k) points.emplace_back((i * a + k * b + (along - i - k) * c) / along);
  }
  return points;
}

/// Returns the share of triangles whose normals point away from the field's gradient in their middle.
inline double foldedShare(const TriangleMesh& mesh, const Field& field) {
  const auto folded = std::ranges::count_if(mesh.triangles, [&](const Triangle& triangle) {
    const auto [a, b, c] = cornersOf(mesh, triangle);
    return (b - a).cross(c - a).dot(field.valueAndGradient((a + b + c) / 3).gradient) < 0;
  });
  return double(folded) / double(mesh.triangles.size());
}

}  // namespace hpsdf::support
