// Contours of fields of real meshes and of random combinations of solids: closed manifolds without crossings.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/combine/combined_distance.h"
#include "hpsdf/continuity.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/output/contour.h"
#include "hpsdf/shapes.h"
#include "support/contour_defects.h"
#include "support/contour_fields.h"
#include "support/random_expression.h"
#include "support/test_mesh.h"

namespace hpsdf {
namespace {

using support::cubeOf;
using support::pointsOf;

/// Returns the blended field of a distance.
Field fieldOf(const DistanceFunction& distance, const Box& domain) {
  Field field = build(distance, domain, {.targetError = 1e-5});
  return field.data().blend == 0 ? blended(field) : field;
}

TEST(ContourMeshes, ofRealMeshesAndTheirOffsetsAreClosedManifolds) {
  HPSDF_SKIP_WITHOUT_MESHES();
  for (const char* name :
       {"paper/bunny_69k.obj", "paper/dragon_80k.obj", "paper/armadillo_100k.obj", "paper/finger_skeletonhand_part.ply",
        "cad/fandisk.obj", "cad/rocker-arm.obj", "cad/wingnut.obj", "cad/cube_12.obj", "cad/1002_tray_bottom.STL"}) {
    SCOPED_TRACE(name);
    const ExactDistance distance(normalized(importMesh(support::testMesh(name)).mesh));
    const Field field = fieldOf(distance, cubeOf(1.1));
    for (const double offset : {0.0, 0.02, -0.02}) {
      const Contour made = contour(field, {.offset = offset, .tolerance = 0.008});
      if (made.mesh.triangles.empty()) continue;  // nothing is left of a plate that shrinks
      EXPECT_EQ(support::contourDefects(made.mesh), "") << offset;
      EXPECT_EQ(made.flawed, 0u);
    }
  }
}

/// Moves points along the gradient to the surface of a field.
void moveToSurface(const Field& field, std::vector<Vector3>& points) {
  for (Vector3& point : points)
    for (int step = 0; step < 6; ++step) {
      const auto [value, gradient] = field.valueAndGradient(point);
      if (gradient.squaredNorm() > 0.01) point -= gradient * (value / gradient.squaredNorm());
    }
}

TEST(ContourMeshes, areWithinTheToleranceOfTheSurfaceAtOtherPointsThanTheyWereMeasured) {
  HPSDF_SKIP_WITHOUT_MESHES();
  const TriangleMesh bunny = normalized(importMesh(support::testMesh("paper/bunny_69k.obj")).mesh);
  const Field field = fieldOf(ExactDistance(bunny), cubeOf(1.1));
  std::vector<Vector3> surface = pointsOf(bunny, 3);
  moveToSurface(field, surface);
  for (const double tolerance : {0.004, 0.009}) {
    SCOPED_TRACE(tolerance);
    const Contour made = contour(field, {.tolerance = tolerance});
    const ExactDistance distance(made.mesh);
    double greatestGap = 0, greatestValue = 0;
    for (const Vector3& point : surface)
      if (std::abs(field.value(point)) < 1e-9) greatestGap = std::max(greatestGap, std::abs(distance(point)));
    for (const Vector3& point : pointsOf(made.mesh, 7))
      greatestValue = std::max(greatestValue, std::abs(field.value(point)));
    EXPECT_LT(greatestGap, 1.05 * tolerance);
    EXPECT_LT(greatestValue, 1.05 * tolerance);
  }
}

TEST(ContourMeshes, ofRandomCombinationsAreClosedManifolds) {
  const std::vector<Expression> solids = {shapes::mesh("sphere"), shapes::mesh("box"), shapes::mesh("torus"),
                                          shapes::mesh("gear")};
  int made = 0;
  for (std::uint64_t seed = 1; made < 20; ++seed) {
    SCOPED_TRACE(seed);
    try {
      const CombinedDistance combined(randomExpression(seed, solids));
      const Box box = combined.source().box;
      const Vector3 margin = Vector3::Constant(0.1 * box.sizes().maxCoeff());
      const Field field = fieldOf(combined, Box(Vector3(box.min() - margin), Vector3(box.max() + margin)));
      const Contour found = contour(field, {.tolerance = 0.01 * box.sizes().maxCoeff()});
      if (found.mesh.triangles.empty()) continue;
      EXPECT_EQ(support::contourDefects(found.mesh), "");
      EXPECT_EQ(found.flawed, 0u);
      ++made;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("nothing is left"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace hpsdf
