// Meshes of contours after vertices were merged and folded triangles turned over.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "contour/cells/implicit_surface.h"
#include "contour/edits/improvement.h"
#include "contour/edits/mesh_editor.h"
#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_report.h"
#include "hpsdf/output/contour.h"
#include "hpsdf/shapes.h"
#include "support/contour_defects.h"
#include "support/contour_fields.h"
#include "support/random_field.h"

namespace hpsdf {
namespace {

using support::exactField;
using support::pointsOf;
using support::torusField;

/// Expects a mesh and a field's surface, of which points are given, to be within a distance of each other.
void expectWithin(double tolerance, const TriangleMesh& mesh, const Field& field, const std::vector<Vector3>& surface) {
  double greatestValue = 0, greatestGap = 0;
  for (const Vector3& point : pointsOf(mesh, 7)) greatestValue = std::max(greatestValue, std::abs(field.value(point)));
  const ExactDistance distance(mesh);
  for (const Vector3& point : surface) greatestGap = std::max(greatestGap, std::abs(distance(point)));
  EXPECT_LE(greatestValue, tolerance);
  EXPECT_LE(greatestGap, tolerance);
}

TEST(ContourEdits, simplifiedMeshesAreClosedManifoldsWithinTheToleranceOfFewerTriangles) {
  const Field gear = exactField("gear");
  for (const Field& field : {torusField(), gear}) {
    const std::vector<Vector3> surface = contour(field, {.tolerance = 0.006}).mesh.vertices;
    const double tolerance = 0.03;
    const Contour all = contour(field, {.tolerance = tolerance});
    const Contour few = contour(field, {.tolerance = tolerance, .simplify = true});
    EXPECT_EQ(support::contourDefects(few.mesh), "");
    EXPECT_LT(few.mesh.triangles.size(), 0.5 * double(all.mesh.triangles.size()));
    EXPECT_EQ(few.normals.size(), few.mesh.vertices.size());
    EXPECT_LE(few.greatestValue, tolerance);
    EXPECT_LE(few.greatestGap, tolerance);
    expectWithin(tolerance, few.mesh, field, surface);
    for (const Vector3& vertex : few.mesh.vertices) EXPECT_LE(std::abs(field.value(vertex)), 1e-3 * tolerance);
  }
}

TEST(ContourEdits, aSimplifiedBoxHasTwelveTriangles) {
  const Contour found = contour(exactField("box"), {.tolerance = 0.01, .simplify = true});
  EXPECT_EQ(support::contourDefects(found.mesh), "");
  EXPECT_EQ(found.mesh.triangles.size(), 12u);
  EXPECT_NEAR(signedVolume(found.mesh), boundingBox(shapes::mesh("box")).volume(), 1e-9);
}

/// Blending rounds the field of a part inside of it, with kinks that are small beside the triangles of its flat sides.
TEST(ContourEdits, simplifiedMeshesOfOffsetsFollowKinksWithinLargeTriangles) {
  const Field gear = blended(build(ExactDistance(shapes::mesh("gear")), support::cubeOf(1.2), {.targetError = 1e-4}));
  const double tolerance = 0.024;
  const Contour few = contour(gear, {.offset = -0.05, .tolerance = tolerance, .simplify = true});
  double greatest = 0;
  for (const Vector3& point : pointsOf(few.mesh, 14)) greatest = std::max(greatest, std::abs(gear.value(point) + 0.05));
  EXPECT_LE(greatest, 1.05 * tolerance);
  EXPECT_LE(greatest, 1.1 * few.greatestValue);
}

/// Random leaves disagree, so that the surface jumps from leaf to leaf, and has parts of all sizes.
TEST(ContourEdits, simplifiedMeshesOfRandomFieldsAreClosedManifoldsOrOpenOnes) {
  const Field field = blended(randomField(0), 0.2);
  const double tolerance = 0.02 * field.domain().sizes().maxCoeff();
  for (const DomainCut cut : {DomainCut::wall, DomainCut::open}) {
    const Contour all = contour(field, {.tolerance = tolerance, .domainCut = cut});
    const Contour few = contour(field, {.tolerance = tolerance, .domainCut = cut, .simplify = true});
    EXPECT_EQ(support::contourDefects(few.mesh, cut == DomainCut::open), "");
    EXPECT_EQ(inspect(few.mesh).boundaryEdges, inspect(all.mesh).boundaryEdges);
    EXPECT_LT(few.mesh.triangles.size(), all.mesh.triangles.size());
  }
}

TEST(ContourEdits, simplifiedMeshesInSinglePrecisionHaveSuchVertices) {
  const Contour found = contour(torusField(), {.tolerance = 0.01, .singlePrecision = true, .simplify = true});
  EXPECT_EQ(support::contourDefects(found.mesh), "");
  for (const Vector3& vertex : found.mesh.vertices) {
    for (const double coordinate : vertex) EXPECT_EQ(static_cast<float>(coordinate), coordinate);
    EXPECT_LE(std::abs(torusField().value(vertex)), 1e-5);
  }
}

TEST(ContourEdits, doNotDependOnThreads) {
  const auto simplified = [](int threads) {
    return contour(torusField(), {.tolerance = 0.01, .simplify = true, .threads = threads});
  };
  const Contour one = simplified(1), two = simplified(2);
  EXPECT_EQ(fingerprint(one.mesh), fingerprint(two.mesh));
  EXPECT_EQ(one.normals, two.normals);
  EXPECT_EQ(one.greatestGap, two.greatestGap);
}

TEST(ContourEdits, leaveHardlyAnyTriangleFolded) {
  const Field gear = exactField("gear");
  EXPECT_LT(support::foldedShare(contour(gear, {.tolerance = 0.005}).mesh, gear), 2e-4);
}

// ---------------------------------------------------------------------------------------------------------------------
// Rounds in which vertices are merged: each reports the share of edges that were tried before it.

struct Rounds {
  std::vector<double> triedShares;
  std::size_t trianglesLeft;
};

/// Merges vertices of a sphere's mesh. With an accuracy below 0 all are refused.
Rounds mergeVertices(TriangleMesh& mesh, double tolerance, double accuracy) {
  static const Field sphere =
      build([](const Vector3& x) { return x.norm() - 1; }, support::cubeOf(1.2), {.targetError = 1e-9});
  const contouring::ImplicitSurface surface(sphere, 0, 1e-3 * tolerance, std::nullopt, 0);
  contouring::EditedMesh edited(mesh.vertices, mesh.triangles);
  Rounds rounds;
  const Progress progress{.report = [&](std::string_view, double share) { rounds.triedShares.push_back(share); },
                          .cancelled = [&] { return rounds.triedShares.size() > 1000; }};
  contouring::MeshEditor editor(surface, {tolerance, accuracy, false, tolerance}, progress, edited);
  contouring::simplify(editor);
  mesh = std::move(edited).finish();
  rounds.trianglesLeft = mesh.triangles.size();
  return rounds;
}

TriangleMesh sphereOfTriangles(int subdivisions) {
  TriangleMesh mesh = shapes::mesh("sphere,subdivisions=" + std::to_string(subdivisions));
  for (Vector3& vertex : mesh.vertices) vertex.normalize();
  return mesh;
}

/// Neighbours of an edge that is tried wait for a later round. What was refused is not tried again where nothing
/// changes.
TEST(ContourEdits, everyRoundTriesOtherEdgesUntilAllWereTriedOnce) {
  TriangleMesh mesh = sphereOfTriangles(3);
  const Rounds rounds = mergeVertices(mesh, 0.1, -1);
  EXPECT_EQ(rounds.trianglesLeft, 1280u);
  EXPECT_GT(rounds.triedShares.size(), 4u);
  EXPECT_EQ(std::ranges::adjacent_find(rounds.triedShares, std::greater_equal()), rounds.triedShares.end());
  EXPECT_GT(rounds.triedShares.back(), 0.9);
}

TEST(ContourEdits, endAfterFiveRoundsThatMergeHardlyAnyVertices) {
  TriangleMesh mesh = sphereOfTriangles(4);
  EXPECT_EQ(mergeVertices(mesh, 0.1, -1).triedShares.size(), 5u);
  EXPECT_EQ(mesh.triangles.size(), 5120u);
}

/// Edges beside merged ones are tried again, so that hardly any is left of which the ends can be merged.
TEST(ContourEdits, leaveHardlyAnyEdgeThatCanBeMerged) {
  TriangleMesh mesh = sphereOfTriangles(3);
  const std::size_t few = mergeVertices(mesh, 0.02, 1e-5).trianglesLeft;
  EXPECT_LT(few, 1280u / 2);
  EXPECT_GE(mergeVertices(mesh, 0.02, 1e-5).trianglesLeft, few - few / 20);
}

TEST(ContourEdits, canBeCancelledWhileVerticesAreMerged) {
  std::size_t checks = 0, limit = ~std::size_t{0};
  const Progress counting{.report = {}, .cancelled = [&] { return ++checks > limit; }};
  contour(torusField(), {.tolerance = 0.01, .threads = 1}, counting);
  limit = checks + 20;
  checks = 0;
  EXPECT_THROW(contour(torusField(), {.tolerance = 0.01, .simplify = true, .threads = 1}, counting), Cancelled);
}

}  // namespace
}  // namespace hpsdf
