// Contours of fields: closed manifolds without crossings, within the tolerance of the surface.

#include "hpsdf/output/contour.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_report.h"
#include "hpsdf/shapes.h"
#include "support/contour_defects.h"
#include "support/contour_fields.h"
#include "support/offset_boxes.h"
#include "support/random_field.h"

namespace hpsdf {
namespace {

using support::cubeOf;
using support::exactField;
using support::torus;
using support::torusField;

double sphere(const Vector3& x) { return x.norm() - 0.7; }

const Field& sphereField() {
  static const Field field = build(sphere, cubeOf(), {.targetError = 1e-9});
  return field;
}

/// Returns the greatest |f| at vertices, and at the middles of triangles and of their sides.
double greatestAt(const TriangleMesh& mesh, const std::function<double(const Vector3&)>& f) {
  double greatest = 0;
  for (const Triangle& triangle : mesh.triangles) {
    const auto [a, b, c] = cornersOf(mesh, triangle);
    for (const Vector3& x : {a, Vector3((a + b + c) / 3), Vector3((a + b) / 2), Vector3((b + c) / 2)})
      greatest = std::max(greatest, std::abs(f(x)));
  }
  return greatest;
}

TEST(Contour, ofSmoothSurfacesIsAClosedManifoldWithinTheTolerance) {
  for (const double tolerance : {0.03, 0.01, 0.003}) {
    const Contour round = contour(sphereField(), {.tolerance = tolerance});
    EXPECT_EQ(support::contourDefects(round.mesh), "") << tolerance;
    EXPECT_LE(greatestAt(round.mesh, sphere), 1.05 * tolerance);
    EXPECT_NEAR(signedVolume(round.mesh), 4.0 / 3 * M_PI * 0.343, 6.2 * tolerance);
    EXPECT_EQ(round.unresolved, 0u);
    EXPECT_EQ(round.flawed, 0u);

    const Contour ring = contour(torusField(), {.tolerance = tolerance});
    EXPECT_EQ(support::contourDefects(ring.mesh), "") << tolerance;
    EXPECT_LE(greatestAt(ring.mesh, torus), 1.05 * tolerance);
    const MeshReport report = inspect(ring.mesh);
    EXPECT_EQ(int(report.vertices) - int(report.faces) / 2, 0) << "the Euler characteristic of a torus";
  }
}

TEST(Contour, verticesLieOnTheSurfaceAndNormalsPointAwayFromIt) {
  const double tolerance = 0.01;
  const Contour round = contour(sphereField(), {.tolerance = tolerance});
  ASSERT_EQ(round.normals.size(), round.mesh.vertices.size());
  for (std::size_t i = 0; i < round.normals.size(); ++i) {
    EXPECT_LE(std::abs(sphereField().value(round.mesh.vertices[i])), 1e-3 * tolerance);
    EXPECT_NEAR(round.normals[i].norm(), 1, 1e-12);
    EXPECT_GT(round.normals[i].dot(round.mesh.vertices[i].normalized()), 0.999);
  }
}

TEST(Contour, offsetsMoveTheSurface) {
  for (const double offset : {-0.2, 0.1, 0.25}) {
    const Contour moved = contour(sphereField(), {.offset = offset, .tolerance = 0.01});
    EXPECT_EQ(support::contourDefects(moved.mesh), "") << offset;
    EXPECT_LE(greatestAt(moved.mesh, [&](const Vector3& x) { return sphere(x) - offset; }), 0.011);
  }
}

TEST(Contour, keepsSharpEdgesAndCorners) {
  const Field box = exactField("box");
  const Contour found = contour(box, {.tolerance = 0.01});
  EXPECT_EQ(support::contourDefects(found.mesh), "");
  const Box bounds = boundingBox(shapes::mesh("box"));
  EXPECT_NEAR(signedVolume(found.mesh), bounds.volume(), 1e-9);
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3 at = bounds.corner(static_cast<Box::CornerType>(corner));
    const bool isFound =
        std::ranges::any_of(found.mesh.vertices, [&](const Vector3& x) { return (x - at).norm() < 1e-9; });
    EXPECT_TRUE(isFound) << at.transpose();
  }
}

TEST(Contour, ofABoxsOffsetsRoundsItsEdgesOutsideAndKeepsThemInside) {
  const Field box = blended(exactField("box"));
  const double offset = 0.05, tolerance = 0.01;
  support::expectOffsetBoxes(contour(box, {.offset = offset, .tolerance = tolerance}).mesh,
                             contour(box, {.offset = -offset, .tolerance = tolerance}).mesh, offset, tolerance);
}

TEST(Contour, ofPartsWithSharpEdgesIsAClosedManifoldWithinTheTolerance) {
  const Field gear = exactField("gear");
  const ExactDistance distance(shapes::mesh("gear"));
  for (const double tolerance : {0.02, 0.005}) {
    const Contour found = contour(gear, {.tolerance = tolerance});
    EXPECT_EQ(support::contourDefects(found.mesh), "") << tolerance;
    EXPECT_LE(greatestAt(found.mesh, [&](const Vector3& x) { return distance(x); }), 1.01 * tolerance);
    EXPECT_EQ(found.unresolved, 0u);
    for (const Vector3& vertex : found.mesh.vertices) EXPECT_LE(std::abs(gear.value(vertex)), 1e-3 * tolerance);
  }
}

/// The command blends fields that jump. Ranges of blended exact leaves are wide, which must not lead to smallest cells
/// all around the surface.
TEST(Contour, ofBlendedExactLeavesTakesAboutAsMuchWorkAsOfOthers) {
  const Field gear = exactField("gear");
  const Contour plain = contour(gear, {.tolerance = 0.01}), smooth = contour(blended(gear), {.tolerance = 0.01});
  EXPECT_EQ(support::contourDefects(smooth.mesh), "");
  EXPECT_LE(smooth.greatestValue, 0.01);
  EXPECT_LE(smooth.greatestGap, 0.01);
  EXPECT_EQ(smooth.lostParts, 0u);
  EXPECT_LT(double(smooth.cells), 4 * double(plain.cells));
}

TEST(Contour, isBlendedFirstWhereItMayHaveSteps) {
  const Field gear = exactField("gear");
  EXPECT_FALSE(mayHaveSteps(gear, 0)) << "the surface passes exact leaves only";
  EXPECT_TRUE(mayHaveSteps(gear, 0.2)) << "this offset passes polynomials";
  EXPECT_TRUE(mayHaveSteps(torusField(), 0));
  EXPECT_FALSE(mayHaveSteps(blended(torusField()), 0));
  EXPECT_EQ(blendedContour(gear, {.tolerance = 0.01}).mesh.vertices, contour(gear, {.tolerance = 0.01}).mesh.vertices);
  EXPECT_EQ(blendedContour(torusField(), {.tolerance = 0.01}).mesh.vertices,
            contour(blended(torusField()), {.tolerance = 0.01}).mesh.vertices);
}

/// Random leaves disagree, so that the surface jumps from leaf to leaf, and has parts of all sizes.
class ContourOfARandomField : public testing::TestWithParam<unsigned> {};

TEST_P(ContourOfARandomField, isAClosedManifoldOrAnOpenOne) {
  const Field field = randomField(GetParam());
  const double tolerance = 0.02 * field.domain().sizes().maxCoeff();
  std::size_t fans = 0;
  for (const Field& one : {field, blended(field, 0.2)}) {
    const Contour found = contour(one, {.tolerance = tolerance});
    EXPECT_EQ(support::contourDefects(found.mesh), "");
    EXPECT_GT(found.mesh.triangles.size(), 100u);
    EXPECT_EQ(found.flawed, 0u);
    fans += found.fans;
    const Contour open = contour(one, {.tolerance = tolerance, .domainCut = DomainCut::open});
    EXPECT_EQ(support::contourDefects(open.mesh, true), "");
  }
  EXPECT_GT(fans, 0u);
}

INSTANTIATE_TEST_SUITE_P(Seeds, ContourOfARandomField, testing::Range(0U, 6U));

TEST(Contour, isClosedByAWallOrOpenWhereTheDomainCutsTheSolid) {
  const Field cut = build(sphere, cubeOf(0.6), {.targetError = 1e-8});
  const Contour closed = contour(cut, {.tolerance = 0.01});
  EXPECT_EQ(support::contourDefects(closed.mesh), "");
  EXPECT_TRUE(cubeOf(0.6).contains(boundingBox(closed.mesh)));
  EXPECT_NEAR(boundingBox(closed.mesh).max().x(), 0.595, 1e-6);

  const Contour open = contour(cut, {.tolerance = 0.01, .domainCut = DomainCut::open});
  EXPECT_EQ(support::contourDefects(open.mesh, true), "");
  EXPECT_GT(inspect(open.mesh).boundaryEdges, 20u);
  EXPECT_LE(greatestAt(open.mesh, sphere), 0.011);
  for (std::size_t i = 0; i < open.normals.size(); ++i)
    EXPECT_GT(open.normals[i].dot(open.mesh.vertices[i].normalized()), 0.99);
}

TEST(Contour, ofADomainThatIsAllOutsideIsEmptyAndOfOneAllInsideItsWall) {
  const Contour all = contour(sphereField(), {.offset = 100, .tolerance = 0.01});
  EXPECT_EQ(support::contourDefects(all.mesh), "");
  EXPECT_NEAR(signedVolume(all.mesh), std::pow(2 - 0.01, 3), 1e-9);
  const Contour none = contour(sphereField(), {.offset = -100});
  EXPECT_TRUE(none.mesh.triangles.empty());
  EXPECT_TRUE(none.mesh.vertices.empty());
}

/// A field of one small leaf that is inside, with a gradient of 0 everywhere.
TEST(Contour, hasUnitNormalsWhereThereIsNoGradient) {
  FieldData data;
  data.domain = cubeOf();
  data.grid = {3, 3, 3};
  std::vector<double> coefficients;
  for (int cell = 0; cell < 27; ++cell) {
    data.nodes.push_back(node::leaf(1, static_cast<std::uint32_t>(coefficients.size())));
    coefficients.insert(coefficients.end(), {cell == 13 ? -1.0 : 1.0, 0, 0, 0});
  }
  data.coefficients = std::move(coefficients);
  const Contour found = contour(Field(std::move(data)), {.tolerance = 0.02});
  EXPECT_EQ(support::contourDefects(found.mesh), "");
  EXPECT_NEAR(signedVolume(found.mesh), std::pow(2.0 / 3, 3), 0.05);
  for (const Vector3& normal : found.normals) EXPECT_NEAR(normal.norm(), 1, 1e-12);
}

TEST(Contour, inSinglePrecisionIsAClosedManifoldOfSuchNumbers) {
  const Field gear = exactField("gear");
  for (const Field& field : {gear, sphereField()}) {
    const double least = leastSinglePrecisionTolerance(field);
    const double longest = field.domain().sizes().maxCoeff();
    for (const double tolerance : {0.005 * longest, 20 * least}) {
      const Contour found = contour(field, {.tolerance = tolerance, .singlePrecision = true});
      EXPECT_EQ(support::contourDefects(found.mesh), "");
      for (const Vector3& vertex : found.mesh.vertices) {
        for (const double coordinate : vertex) EXPECT_EQ(static_cast<float>(coordinate), coordinate);
        EXPECT_LE(std::abs(field.value(vertex)), 1e-3 * tolerance + 1e-12);
      }
    }
    EXPECT_THROW(contour(field, {.tolerance = least / 2, .singlePrecision = true}), Error);
  }
}

/// A plate that is thinner than the smallest cells, between two solids.
TEST(Contour, countsCellsThatLoseParts) {
  const auto withPlate = [](const Vector3& x) {
    return std::min(x.norm() - 0.3, std::max(std::abs(x.z() - 0.5) - 0.01, x.head<2>().norm() - 0.3));
  };
  const Field field = build(withPlate, cubeOf(), {.targetError = 1e-6});
  const Contour coarse = contour(field, {.tolerance = 0.05});
  const Contour sphereContour = contour(sphereField(), {.tolerance = 0.05});
  EXPECT_GT(coarse.lostParts, 10u);
  EXPECT_EQ(sphereContour.lostParts, 0u);
}

TEST(Contour, doesNotDependOnThreads) {
  const Contour one = contour(torusField(), {.tolerance = 0.01, .threads = 1});
  const Contour two = contour(torusField(), {.tolerance = 0.01, .threads = 2});
  EXPECT_EQ(fingerprint(one.mesh), fingerprint(two.mesh));
  EXPECT_EQ(one.normals, two.normals);
}

TEST(Contour, refusesOptionsOutOfRangeAndCanBeCancelled) {
  EXPECT_THROW(contour(sphereField(), {.offset = NAN}), Error);
  EXPECT_THROW(contour(sphereField(), {.tolerance = -1}), Error);
  EXPECT_THROW(contour(sphereField(), {.tolerance = 1e-8}), Error);
  EXPECT_THROW(contour(sphereField(), {.tolerance = INFINITY}), Error);
  EXPECT_THROW(contour(sphereField(), {}, Progress{.cancelled = [] { return true; }}), Cancelled);
}

}  // namespace
}  // namespace hpsdf
