// Contours of fields of real meshes and of random combinations of solids: closed manifolds without crossings.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/output/contour.h"
#include "support/combined_contours.h"
#include "support/contour_defects.h"
#include "support/contour_fields.h"
#include "support/offset_boxes.h"
#include "support/test_mesh.h"

namespace hpsdf {
namespace {

using support::blendedField;
using support::cubeOf;
using support::exactField;
using support::pointsOf;

/// Expects contours of a mesh's field and of its offsets to be closed manifolds without crossings.
void expectClosedManifolds(const TriangleMesh& mesh) {
  const Field field = blendedField(ExactDistance(normalized(mesh)), cubeOf(1.1));
  for (const double offset : {0.0, 0.02, -0.02}) {
    const Contour made = contour(field, {.offset = offset, .tolerance = 0.008});
    if (made.mesh.triangles.empty()) continue;  // nothing is left of a plate that shrinks
    EXPECT_EQ(support::contourDefects(made.mesh), "") << offset;
    EXPECT_EQ(made.flawed, 0u);
  }
}

TEST(ContourMeshes, ofRealMeshesAndTheirOffsetsAreClosedManifolds) {
  HPSDF_SKIP_WITHOUT_MESHES();
  for (const char* name :
       {"paper/bunny_69k.obj", "paper/dragon_80k.obj", "paper/armadillo_100k.obj", "paper/finger_skeletonhand_part.ply",
        "cad/fandisk.obj", "cad/rocker-arm.obj", "cad/wingnut.obj", "cad/cube_12.obj", "cad/1002_tray_bottom.STL"}) {
    SCOPED_TRACE(name);
    expectClosedManifolds(importMesh(support::testMesh(name)).mesh);
  }
}

/// This bunny folds over itself.
TEST(ContourMeshes, ofAnInstalledBunnyAndItsOffsetsAreClosedManifolds) {
  const std::filesystem::path file = "/usr/share/glmark2/models/bunny.obj";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not installed (package glmark2-data)";
  expectClosedManifolds(importMesh(file).mesh);
}

/// An edge of a mesh by its ends.
struct Segment {
  Vector3 from, to;
};

/// Returns the edges between two triangles whose normals differ by more than an angle in degrees.
std::vector<Segment> sharpEdges(const TriangleMesh& mesh, double degrees) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<Vector3>> normalsOf;
  for (const Triangle& triangle : mesh.triangles) {
    const auto [a, b, c] = cornersOf(mesh, triangle);
    const Vector3 normal = (b - a).cross(c - a).normalized();
    for (std::size_t k = 0; k < 3; ++k) normalsOf[std::minmax(triangle[k], triangle[(k + 1) % 3])].push_back(normal);
  }
  std::vector<Segment> edges;
  for (const auto& [ends, normals] : normalsOf)
    if (normals.size() == 2 && normals[0].dot(normals[1]) < std::cos(degrees * std::numbers::pi / 180))
      edges.push_back({mesh.vertices[ends.first], mesh.vertices[ends.second]});
  return edges;
}

double distanceTo(const Segment& segment, const Vector3& point) {
  const Vector3 along = segment.to - segment.from;
  const double t = std::clamp((point - segment.from).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (segment.from + t * along - point).norm();
}

/// One in a hundred ends of sharp edges of the mesh lies farther away, where sharp edges of the surface end or run
/// through cells without a vertex of their own; of tolerances half as large, one in three hundred.
TEST(ContourMeshes, ofAPartFollowItsSharpEdges) {
  HPSDF_SKIP_WITHOUT_MESHES();
  const TriangleMesh part = normalized(importMesh(support::testMesh("cad/fandisk.obj")).mesh);
  const double longest = boundingBox(part).sizes().maxCoeff();
  const Field field = blendedField(ExactDistance(part), cubeOf(1.1));
  const Contour made = contour(field, {.tolerance = 2e-3 * longest});
  const std::vector<Segment> edges = sharpEdges(part, 30);
  std::size_t ends = 0, off = 0;
  for (const Segment& edge : sharpEdges(made.mesh, 60))
    for (const Vector3& end : {edge.from, edge.to}) {
      const bool isOn =
          std::ranges::any_of(edges, [&](const Segment& e) { return distanceTo(e, end) < 1e-3 * longest; });
      ++ends;
      off += isOn ? 0 : 1;
    }
  EXPECT_GT(ends, 1000u);
  EXPECT_LT(double(off), 0.02 * double(ends));
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
  const Field field = blendedField(ExactDistance(bunny), cubeOf(1.1));
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
  for (const auto& [seed, made] : support::contoursOfCombinations(20)) {
    SCOPED_TRACE(seed);
    EXPECT_EQ(support::contourDefects(made.mesh), "");
    EXPECT_EQ(made.flawed, 0u);
  }
}

/// Fields of combined solids resolve sharp edges by their cells alone.
TEST(ContourMeshes, ofCombinedOffsetsRoundABoxsEdgesOutsideAndKeepThemInside) {
  const double offset = 0.05, tolerance = 0.01;
  const auto offsetBox = [&](double distance, double targetError) {
    const CombinedDistance combined(combine::offset(shapes::mesh("box"), distance));
    const Field field = blendedField(combined, support::domainAround(combined), targetError);
    return contour(field, {.tolerance = tolerance}).mesh;
  };
  support::expectOffsetBoxes(offsetBox(offset, 1e-8), offsetBox(-offset, 1e-9), offset, tolerance, 1.5e-3);
}

TEST(ContourMeshes, haveHardlyAnyTriangleFolded) {
  const Field gear = exactField("gear");
  for (const double tolerance : {0.01, 0.005}) {
    SCOPED_TRACE(tolerance);
    for (const bool simplify : {false, true}) {
      const ContourOptions options{.tolerance = tolerance, .simplify = simplify};
      EXPECT_LT(support::foldedShare(contour(support::torusField(), options).mesh, support::torusField()), 2e-4);
      EXPECT_LT(support::foldedShare(contour(gear, options).mesh, gear), 2e-4);
    }
  }
}

}  // namespace
}  // namespace hpsdf
