#pragma once
// Contours of the built-in box that grew or shrank, against the shapes that these are in closed form.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"
#include "hpsdf/triangle_mesh.h"
#include "support/contour_defects.h"
#include "support/contour_fields.h"

namespace hpsdf::support {

inline double boxDistance(const Box& box, const Vector3& x) {
  const Vector3 beyond = (x - box.center()).cwiseAbs() - box.sizes() / 2;
  return beyond.cwiseMax(0).norm() + std::min(beyond.maxCoeff(), 0.0);
}

/// Returns points of the twelve edges of a box.
inline std::vector<Vector3> edgePoints(const Box& box) {
  constexpr int kAlong = 50;
  std::vector<Vector3> points;
  for (int axis = 0; axis < 3; ++axis)
    for (int edge = 0; edge < 4; ++edge)
      for (int n = 0; n <= kAlong; ++n) {
        Vector3 share;
        share[axis] = double(n) / kAlong;
        share[(axis + 1) % 3] = edge & 1;
        share[(axis + 2) % 3] = edge >> 1;
        points.emplace_back(box.min() + share.cwiseProduct(box.sizes()));
      }
  return points;
}

/// Expects the meshes of the built-in box after an offset outwards, which rounds its edges, and inwards, which keeps
/// them sharp: vertices lie on the surface to within a thousandth of the box's longest side, and the sharp edges on the
/// mesh to within `edgeAccuracy` of it.
inline void expectOffsetBoxes(const TriangleMesh& grown, const TriangleMesh& shrunk, double offset, double tolerance,
                              double edgeAccuracy = 1e-3) {
  const Box box = boundingBox(shapes::mesh("box"));
  const Box inner(Vector3(box.min().array() + offset), Vector3(box.max().array() - offset));
  const double longest = box.sizes().maxCoeff(), accuracy = 1e-3 * longest;
  const auto greatest = [](const std::vector<Vector3>& points, const auto& distance) {
    double found = 0;
    for (const Vector3& point : points) found = std::max(found, std::abs(distance(point)));
    return found;
  };
  const auto toRounded = [&](const Vector3& x) { return boxDistance(box, x) - offset; };
  EXPECT_EQ(contourDefects(grown), "");
  EXPECT_LE(greatest(grown.vertices, toRounded), accuracy);
  EXPECT_LE(greatest(pointsOf(grown, 4), toRounded), 1.05 * tolerance);
  EXPECT_EQ(contourDefects(shrunk), "");
  EXPECT_LE(greatest(shrunk.vertices, [&](const Vector3& x) { return boxDistance(inner, x); }), accuracy);
  EXPECT_LE(greatest(edgePoints(inner), ExactDistance(shrunk)), edgeAccuracy * longest);
}

}  // namespace hpsdf::support
