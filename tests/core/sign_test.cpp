// Tests of the sign of distances for meshes that are closed, folded, nested, overlapping or open.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/detail/sign_check.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/shapes.h"
#include "sign/angle_block.h"
#include "sign/boundary_edges.h"
#include "sign/solid_angle.h"
#include "sign/winding_number.h"
#include "support/made_meshes.h"
#include "support/test_mesh.h"

namespace hpsdf {
namespace sign_test {

using bvh::Hierarchy;
using sign::BoundaryEdges;
using sign::WindingNumber;
using support::boxOfTwo;
using support::joined;
using support::moved;
using support::openBox;
using support::placesIn;
using support::reversed;

/// Returns the winding number as the sum over all triangles. It computes solid angles by Girard's theorem from the
/// angles between the planes through x, which is independent of the library's formula.
double sumOfAngles(const TriangleMesh& mesh, const Vector3& x) {
  long double sum = 0;
  using Long = Eigen::Matrix<long double, 3, 1>;
  for (const auto& triangle : mesh.triangles) {
    std::array<Long, 3> to, side;
    for (int k = 0; k < 3; ++k) to[k] = (mesh.vertices[triangle[k]] - x).cast<long double>().normalized();
    const long double volume = to[0].dot(to[1].cross(to[2]));
    if (volume == 0) continue;
    for (int k = 0; k < 3; ++k) side[k] = to[k].cross(to[(k + 1) % 3]);
    long double angles = -std::numbers::pi_v<long double>;
    for (int k = 0; k < 3; ++k) {
      const Long before = -side[(k + 2) % 3];
      angles += std::atan2(side[k].cross(before).norm(), side[k].dot(before));
    }
    sum += volume > 0 ? angles : -angles;
  }
  return double(sum / (4 * std::numbers::pi_v<long double>));
}

const DistanceOptions kAutomatic{.insideTest = InsideTest::automatic};

double value(const ExactDistance& distance, const Vector3& x) { return distance(x); }

TEST(WindingNumber, estimatesAreWithinTheirErrorBounds) {
  for (const TriangleMesh& mesh :
       {shapes::mesh("builtin:gear"), openBox(), shapes::mesh("builtin:torus,segments=48,sides=24")}) {
    const Hierarchy hierarchy(mesh, boundingBox(mesh));
    const WindingNumber winding(hierarchy);
    double greatest = 0;
    for (const Vector3& x : placesIn(boundingBox(mesh), 100)) {
      const double exact = sumOfAngles(mesh, x);
      EXPECT_NEAR(winding.exact(x), exact, 1e-9);
      for (int level = 0; level < WindingNumber::kLevels; ++level) {
        const WindingNumber::Estimate estimate = winding.estimate(x, level);
        EXPECT_LE(std::abs(estimate.value - exact), estimate.error + 1e-9) << "level " << level;
        if (level == 0) greatest = std::max(greatest, std::abs(estimate.value - exact));
      }
      EXPECT_EQ(winding.isAbove(x), exact > 0.5);
      EXPECT_LE(winding.estimateWithin(x, 1e-6, [](auto&) { return false; }).error, 1e-6);
    }
    EXPECT_TRUE(mesh.triangles.size() < 1000 || greatest > 1e-9) << "no cluster was replaced by its series";
  }
}

/// Returns the mesh without the faces 0, every, 2·every, …
TriangleMesh withHoles(TriangleMesh mesh, std::size_t every) {
  std::vector<std::array<std::uint32_t, 3>> left;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
    if (f % every != 0) left.push_back(mesh.triangles[f]);
  mesh.triangles = std::move(left);
  return mesh;
}

TEST(BoundaryEdges, gradientsAreWithinTheirErrorBounds) {
  const TriangleMesh sphere = shapes::mesh("builtin:sphere,subdivisions=4");
  const Hierarchy hierarchy(withHoles(sphere, 7), boundingBox(sphere));
  const BoundaryEdges edges(hierarchy);
  ASSERT_GT(edges.size(), 1000u);
  double greatest = 0;
  std::size_t terms = 0;
  for (const Vector3& x : placesIn(boundingBox(sphere), 200)) {
    const Vector3 local = hierarchy.local(x);
    const BoundaryEdges::Gradient exact = edges.gradient(local, 0);
    EXPECT_EQ(exact.terms, edges.size());
    EXPECT_EQ(exact.error, 0);
    double slope = 0;
    for (int k = 0; k < 3; ++k) {
      const Vector3 step = 1e-5 * exact.edgeDistance * Vector3::Unit(k);
      const Vector3 change = edges.gradient(local + step, 0).value - edges.gradient(local - step, 0).value;
      slope = std::max(slope, change.norm() / (2 * step.norm()));
    }
    for (const double error : {1.0, 1e-2, 1e-4}) {
      const BoundaryEdges::Gradient found = edges.gradient(local, error);
      EXPECT_LE(found.error, error);
      EXPECT_LE((found.value - exact.value).norm(), found.error + 1e-9);
      EXPECT_GE(found.derivative + found.derivativeByMoments, slope * (1 - 1e-3));
      EXPECT_LE(found.edgeDistance, exact.edgeDistance * (1 + 1e-9));
      if (error == 1) {
        terms += found.terms;
        greatest = std::max(greatest, (found.value - exact.value).norm());
      }
    }
  }
  EXPECT_LT(terms, 200 * edges.size() / 5) << "few clusters were replaced by their series";
  EXPECT_GT(greatest, 1e-6) << "no cluster was replaced by its series";
}

/// Returns the mesh with these faces twice.
TriangleMesh doubled(TriangleMesh mesh, std::size_t faces) {
  for (std::size_t f = 0; f < faces; ++f) mesh.triangles.push_back(mesh.triangles[f]);
  return mesh;
}

TEST(BoundaryEdges, tellTheExactWindingNumber) {
  const TriangleMesh sphere = shapes::mesh("builtin:sphere,subdivisions=4");
  for (const TriangleMesh& mesh : {withHoles(sphere, 100), doubled(sphere, 40)}) {
    const Hierarchy hierarchy(mesh, boundingBox(mesh));
    const BoundaryEdges edges(hierarchy);
    ASSERT_TRUE(edges.haveFans());
    for (const Vector3& x : placesIn(boundingBox(mesh), 200)) {
      const Vector3 local = hierarchy.local(x);
      const double exact = sumOfAngles(mesh, x);
      for (const double error : {-0.39, 0.0, 0.39}) {
        const auto found = edges.exactWinding(local, exact + error, std::abs(error) + 0.01);
        ASSERT_TRUE(found);
        EXPECT_NEAR(*found, exact, 1e-9) << x.transpose();
      }
      EXPECT_FALSE(edges.exactWinding(local, exact + 0.2, 0.1)) << "the estimate is worse than it says";
    }
  }
  const Hierarchy manyHoles(withHoles(sphere, 7), boundingBox(sphere));
  EXPECT_FALSE(BoundaryEdges(manyHoles).haveFans());
}

TEST(BoundaryEdges, doNotTellTheWindingNumberWhereRoundingSpoilsIt) {
  const Vector3 common(0.2718281828459045, 0.3141592653589793, 0.1618033988749895);
  const TriangleMesh sphere = shapes::mesh("builtin:sphere,subdivisions=4");
  const TriangleMesh mesh = withHoles(sphere, 1000);
  const Hierarchy hierarchy(mesh, boundingBox(mesh));
  const BoundaryEdges edges(hierarchy);
  EXPECT_FALSE(edges.exactWinding(common, 0.5, 0.4));
  for (const std::uint32_t vertex : sphere.triangles[0]) {
    const Vector3 end = hierarchy.local(sphere.vertices[vertex]);
    for (const double share : {0.1, 0.5, 0.9}) {
      const Vector3 onLine = common + share * (end - common);
      EXPECT_FALSE(edges.exactWinding(onLine, 0.5, 0.4));
      for (const double offset : {1e-14, 1e-12, 1e-10, 1e-8, 1e-6}) {
        const Vector3 local = onLine + Vector3(offset, -offset, 2 * offset);
        const double exact =
            sumOfAngles(mesh, mesh.vertices[0] + (local - hierarchy.local(mesh.vertices[0])) / hierarchy.scale());
        EXPECT_NEAR(edges.exactWinding(local, exact + 0.3, 0.35).value_or(exact), exact, 1e-6) << offset;
      }
    }
  }
}

/// Errors of winding numbers would be noise in the distance, which a construction would try to resolve.
TEST(InsideTest, hasNoNoiseBesideHoles) {
  TriangleMesh mesh = shapes::mesh("builtin:sphere,subdivisions=5");
  std::erase_if(mesh.triangles, [&](const auto& triangle) { return mesh.vertices[triangle[0]].z() > 0.8; });
  const ExactDistance distance(mesh, kAutomatic);
  const Hierarchy hierarchy(mesh, boundingBox(mesh));
  const BoundaryEdges edges(hierarchy);
  int tried = 0;
  for (const Vector3& x : placesIn(Box(Vector3(-0.3, -0.3, 0.7), Vector3(0.3, 0.3, 0.9)), 100)) {
    const double slope = edges.gradient(hierarchy.local(x), 0).value.norm() * hierarchy.scale();
    const double toClosingSurface = (0.5 - sumOfAngles(mesh, x)) / slope;
    const ClosestPoint closest = distance.closestPoint(x);
    if (std::abs(toClosingSurface) > 0.99 * (closest.point - x).norm()) continue;
    ++tried;
    EXPECT_NEAR(closest.signedDistance, toClosingSurface, 1e-7) << x.transpose();
  }
  EXPECT_GT(tried, 50);
}

/// The two sides of a slit cancel in the winding number, so that a sample tells the signs of points around it.
TEST(BoundaryEdges, ofNarrowSlitsHardlyChangeTheGradient) {
  TriangleMesh tube;  // square, with a slit along one of its edges
  constexpr int kSteps = 1000;
  constexpr std::uint32_t kAround = 5;
  for (int i = 0; i <= kSteps; ++i)
    for (const auto& [x, y] :
         {std::pair(1.0, 0.0), std::pair(0.0, 1.0), std::pair(-1.0, 0.0), std::pair(0.0, -1.0), std::pair(1.0, -1e-4)})
      tube.vertices.emplace_back(x, y, i / 100.0);
  for (std::uint32_t i = 0; i < kSteps; ++i)
    for (std::uint32_t side = 0; side + 1 < kAround; ++side) {
      const std::uint32_t at = kAround * i + side;
      tube.triangles.push_back({at, at + 1, at + kAround + 1});
      tube.triangles.push_back({at, at + kAround + 1, at + kAround});
    }
  const Hierarchy hierarchy(tube, boundingBox(tube));
  const BoundaryEdges edges(hierarchy);
  const Vector3 above = hierarchy.local({1.5, 0, 5});
  const BoundaryEdges::Gradient found = edges.gradient(above, 0.1);
  EXPECT_LT(found.derivative + found.derivativeByMoments, 0.2 * edges.gradient(above, 0).derivative);
}

/// Stacked discs whose first moments cancel: far away the winding number hardly changes, between them it changes fast.
TEST(InsideTest, nearStackedDiscsIsTheSameInBatches) {
  constexpr double kRadius = 0.0015;
  constexpr std::uint32_t kCorners = 180, kCopies = 100;
  TriangleMesh mesh =
      joined(moved(boxOfTwo(), Vector3::Constant(1), 0.01), moved(boxOfTwo(), -Vector3::Constant(1), 0.01));
  for (const int level : {-1, 0, 1}) {
    const auto centre = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.emplace_back(0, 0, level * kRadius);
    for (std::uint32_t i = 0; i < kCorners; ++i) {
      const double angle = 2 * std::numbers::pi * i / kCorners;
      mesh.vertices.emplace_back(kRadius * std::cos(angle), kRadius * std::sin(angle), level * kRadius);
    }
    for (std::uint32_t copy = 0; copy < (level == 0 ? 2 : 1) * kCopies; ++copy)
      for (std::uint32_t i = 0; i < kCorners; ++i) {
        const std::uint32_t here = centre + 1 + i, next = centre + 1 + (i + 1) % kCorners;
        mesh.triangles.push_back(level == 0 ? Triangle{centre, here, next} : Triangle{centre, next, here});
      }
  }
  const ExactDistance distance(mesh, {.insideTest = InsideTest::winding});
  for (const double height : {0.002, 0.003, 0.0045, 0.006, 0.01, 0.03})
    for (const double side : {-1.0, 1.0}) {
      const std::vector<Vector3> points = {{0, 0, 0.9 * side}, {0, 0, (height + kRadius) * side}};
      std::vector<double> both(2);
      distance(points, both);
      EXPECT_EQ(both[1], value(distance, points[1])) << height * side;
    }
}

TEST(BoundaryEdges, gradientsEqualDifferenceQuotients) {
  const TriangleMesh sphere = shapes::mesh("builtin:sphere,subdivisions=4");
  const TriangleMesh mesh = withHoles(sphere, 7);
  const Hierarchy hierarchy(mesh, boundingBox(mesh));
  const BoundaryEdges edges(hierarchy);
  const double step = 1e-4;
  int tried = 0;
  for (const Vector3& x : placesIn(boundingBox(mesh), 20)) {
    const BoundaryEdges::Gradient found = edges.gradient(hierarchy.local(x), 1e-4);
    if (found.edgeDistance < 0.1) continue;
    ++tried;
    for (int k = 0; k < 3; ++k) {
      const Vector3 offset = step * Vector3::Unit(k);
      const double change = (sumOfAngles(mesh, x + offset) - sumOfAngles(mesh, x - offset)) / (2 * step);
      EXPECT_NEAR(found.value[k] * hierarchy.scale(), change, 2e-4);
    }
  }
  EXPECT_GT(tried, 5);
}

TEST(BoundaryEdges, gradientsOfFewEdgesAreExactWhateverErrorIsAllowed) {
  const TriangleMesh mesh = openBox();
  const Hierarchy hierarchy(mesh, boundingBox(mesh));
  const BoundaryEdges edges(hierarchy);
  const BoundaryEdges::Gradient found = edges.gradient({100, 0, 0}, HUGE_VAL);
  EXPECT_EQ(found.error, 0);
  EXPECT_EQ(found.terms, edges.size());
}

TEST(InsideTest, isThePseudonormalForClosedMeshes) {
  const TriangleMesh mesh = shapes::mesh("builtin:gear");
  const ExactDistance distance(mesh, kAutomatic), byWinding(mesh, {.insideTest = InsideTest::winding});
  EXPECT_EQ(distance.insideTestChoice().insideTest, InsideTest::pseudonormal);
  EXPECT_EQ(distance.source().insideTest, InsideTest::pseudonormal);
  EXPECT_THAT(distance.insideTestChoice().reason, testing::HasSubstr("does not intersect itself"));
  for (const Vector3& x : placesIn(boundingBox(mesh), 2000)) EXPECT_EQ(distance(x), byWinding(x));
}

TEST(InsideTest, agreesWithTheWindingNumberForInwardMeshes) {
  const TriangleMesh mesh = reversed(shapes::mesh("builtin:torus,segments=48,sides=24"));
  const ExactDistance distance(mesh, kAutomatic), byWinding(mesh, {.insideTest = InsideTest::winding});
  EXPECT_EQ(distance.insideTestChoice().insideTest, InsideTest::pseudonormal);
  for (const Vector3& x : placesIn(boundingBox(mesh), 1000)) EXPECT_EQ(distance(x), byWinding(x));
}

TEST(InsideTest, ofOverlappingBodiesIsThatOfTheirUnion) {
  const TriangleMesh ball = shapes::mesh("builtin:sphere,subdivisions=3");
  const ExactDistance distance(joined(ball, moved(ball, {1, 0, 0})), kAutomatic);
  EXPECT_EQ(distance.insideTestChoice().insideTest, InsideTest::winding);
  EXPECT_THAT(distance.insideTestChoice().reason, testing::HasSubstr("intersects itself"));
  EXPECT_LT(value(distance, {0.5, 0, 0}), 0);
  EXPECT_LT(value(distance, {0.02, 0, 0}), 0) << "the point is inside one ball, near the surface of the other";
  EXPECT_GT(value(distance, {2.5, 0, 0}), 0);
}

TEST(InsideTest, ofNestedBodiesIsThatOfTheOuterBody) {
  const TriangleMesh ball = shapes::mesh("builtin:sphere,subdivisions=3");
  const ExactDistance solid(joined(ball, moved(ball, Vector3::Zero(), 0.5)), kAutomatic);
  EXPECT_EQ(solid.insideTestChoice().insideTest, InsideTest::winding);
  EXPECT_THAT(solid.insideTestChoice().reason, testing::HasSubstr("lies within another"));
  EXPECT_LT(value(solid, {0.55, 0, 0}), 0);
  const ExactDistance hollow(joined(ball, reversed(moved(ball, Vector3::Zero(), 0.5))), kAutomatic);
  EXPECT_EQ(hollow.insideTestChoice().insideTest, InsideTest::pseudonormal);
  EXPECT_GT(value(hollow, {0.3, 0, 0}), 0);
}

TEST(InsideTest, isThePseudonormalForSeparateBodies) {
  const TriangleMesh ball = shapes::mesh("builtin:sphere,subdivisions=2");
  const TriangleMesh mesh = joined(ball, joined(moved(ball, {3, 0, 0}), moved(ball, {0, 3, 0}, 0.1)));
  const ExactDistance distance(mesh, kAutomatic), byWinding(mesh, {.insideTest = InsideTest::winding});
  EXPECT_EQ(distance.insideTestChoice().insideTest, InsideTest::pseudonormal);
  for (const Vector3& x : placesIn(boundingBox(mesh), 2000)) EXPECT_EQ(distance(x), byWinding(x));
}

/// At the welded common edge of two boxes the normals of four faces cancel.
TEST(InsideTest, isTheWindingNumberForBodiesThatShareAnEdge) {
  const TriangleMesh box = shapes::mesh("box,width=2,height=2,depth=2");
  const TriangleMesh mesh = cleaned(joined(box, moved(box, {2, 2, 0}))).mesh;
  const ExactDistance distance(mesh, kAutomatic), byWinding(mesh, {.insideTest = InsideTest::winding});
  EXPECT_GT(inspect(mesh).nonManifoldEdges, 0u);
  EXPECT_EQ(distance.insideTestChoice().insideTest, InsideTest::winding);
  for (const Vector3& x : placesIn(boundingBox(mesh), 2000)) EXPECT_EQ(distance(x), byWinding(x));
}

/// One vertex of a ball is pushed through the opposite side: the spike is inside out and misleads pseudonormals.
TEST(InsideTest, isRightWhereAClosedMeshFoldsIntoItself) {
  TriangleMesh mesh = shapes::mesh("builtin:sphere,subdivisions=3");
  const std::uint32_t vertex = mesh.triangles[100][0];
  mesh.vertices[vertex] *= -1.5;
  const ExactDistance distance(mesh, kAutomatic), byNormals(mesh, {.insideTest = InsideTest::pseudonormal});
  EXPECT_EQ(distance.insideTestChoice().insideTest, InsideTest::winding);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> u(-0.5, 0.5);
  int misled = 0;
  for (int n = 0; n < 2000; ++n) {
    const double a = u(random), b = u(random), c = u(random);
    const Vector3 x = mesh.vertices[vertex] + Vector3(a, b, c);
    const double exact = sumOfAngles(mesh, x);
    if (std::abs(distance(x)) < 1e-9) continue;
    EXPECT_EQ(distance(x) < 0, exact > 0.5) << x.transpose();
    misled += (byNormals(x) < 0) != (exact > 0.5);
  }
  EXPECT_GT(misled, 0) << "the test has no power";
}

TEST(InsideTest, holesAreClosedWithoutAJump) {
  const TriangleMesh mesh = openBox();
  const ExactDistance distance(mesh, kAutomatic);
  EXPECT_EQ(distance.insideTestChoice().insideTest, InsideTest::winding);
  EXPECT_THAT(distance.insideTestChoice().reason,
              testing::StartsWith("4 edges are unbalanced (holes or reversed faces), and holes"));
  EXPECT_LT(value(distance, {0, 0, 0}), -0.9);
  EXPECT_GT(value(distance, {0, 0, 3}), 0.5);
  EXPECT_GT(value(distance, {0, 0, -1.5}), 0.49);
  double steepest = 0, least = 1;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> u(-1.5, 1.5);
  for (int n = 0; n < 200; ++n) {  // straight paths through the box and its hole
    const double a = u(random), b = u(random), c = u(random), d = u(random);
    const Vector3 from(a, b, -1.5), to(c, d, 2);
    double before = distance(from);
    for (int i = 1; i <= 500; ++i) {
      const double now = distance(from + (to - from) * (i / 500.0));
      steepest = std::max(steepest, std::abs(now - before) / ((to - from).norm() / 500));
      least = std::min(least, now);
      before = now;
    }
  }
  EXPECT_LT(steepest, 2.5) << "a jump of 1 within 1/500 of the path would have a slope of about 150";
  EXPECT_LT(least, -0.5);
}

TEST(InsideTest, fieldsOfOpenMeshesAreNotRefinedWithoutEnd) {
  const TriangleMesh mesh = openBox();
  const BuildOptions options{.targetError = 1e-5, .strategy = Strategy::hp};
  const Field field = build(ExactDistance(mesh, kAutomatic), domainAround(mesh), options);
  const Field unsignedField =
      build(ExactDistance(mesh, {.insideTest = InsideTest::shell, .thickness = 1e-9}), domainAround(mesh), options);
  // For comparison, `jump` has the sign of the winding number but ignores the surface that closes the hole: it jumps.
  const ExactDistance byNormals(mesh, {.insideTest = InsideTest::pseudonormal}), byWinding(mesh, kAutomatic);
  const auto jump = [&](const Vector3& x) { return std::copysign(byNormals(x), byWinding(x)); };
  BuildOptions asLong = options;
  asLong.maxSteps = field.metadata().steps;
  const Field jumping = build(jump, domainAround(mesh), asLong);
  EXPECT_LT(field.data().nodes.size(), unsignedField.data().nodes.size());
  EXPECT_LT(field.metadata().totalError, 1e-5);
  EXPECT_GT(jumping.metadata().totalError, 1e-4) << "the test has no power";
  EXPECT_EQ(field.metadata().source.insideTest, InsideTest::winding);
}

TEST(InsideTest, singleAndBatchedQueriesAgreeBitForBit) {
  const TriangleMesh ball = shapes::mesh("builtin:sphere,subdivisions=3");
  const TriangleMesh torn = withHoles(shapes::mesh("builtin:sphere,subdivisions=4"), 7);
  for (const TriangleMesh& mesh : {openBox(), torn, joined(ball, moved(ball, {1, 0, 0}))}) {
    const ExactDistance distance(mesh, kAutomatic);
    ASSERT_EQ(distance.insideTestChoice().insideTest, InsideTest::winding);
    for (const double size :
         {2.0, 0.3, 0.01}) {  // edge of the box of points; the sides of close points are derived from each other
      const Box box(Vector3(0.9, 0.2, 0.95), Vector3(0.9, 0.2, 0.95) + Vector3::Constant(size));
      std::vector<Vector3> points = placesIn(box, 700);
      points[13].setConstant(std::numeric_limits<double>::quiet_NaN());
      std::vector<double> found(points.size());
      distance(points, found);
      EXPECT_FALSE(std::isfinite(std::exchange(found[13], 0)));
      points[13] = mesh.vertices[0];
      for (std::size_t i = 0; i < points.size(); ++i)
        EXPECT_EQ(found[i], distance(points[i])) << "point " << i << " of " << size;
    }
  }
}

TEST(InsideTest, ofAShellIsNegativeOnlyWithinTheWall) {
  TriangleMesh sheet;
  sheet.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  const ExactDistance withoutThickness(sheet, kAutomatic);
  EXPECT_THAT(withoutThickness.insideTestChoice().reason, testing::HasSubstr("enclose nothing"));
  const ExactDistance shell(sheet, {.insideTest = InsideTest::shell, .thickness = 0.1});
  EXPECT_EQ(value(shell, {0, 0, 0}), -0.05);
  EXPECT_DOUBLE_EQ(value(shell, {0, 0, -0.5}), 0.45);
  EXPECT_DOUBLE_EQ(shell.closestPoint({0, 0, 0.5}).signedDistance, 0.45);
  EXPECT_EQ(shell.source().thickness, 0.1);
  EXPECT_THROW(ExactDistance(sheet, {.insideTest = InsideTest::shell}), Error);
  EXPECT_THROW(ExactDistance(sheet, {.thickness = 0.1}), Error);
  EXPECT_THROW(ExactDistance(sheet, {.insideTest = InsideTest::shell, .thickness = HUGE_VAL}), Error);
}

TEST(InsideTest, isTheSameAtAnyScale) {
  const TriangleMesh mesh = openBox();
  const std::vector<Vector3> points = placesIn(boundingBox(mesh), 300);
  const ExactDistance unscaled(mesh, kAutomatic);
  for (const double scale : {1e-20, 1e-6, 1e6, 1e20}) {
    const ExactDistance scaled(moved(mesh, Vector3::Zero(), scale), kAutomatic);
    for (const Vector3& x : points) EXPECT_NEAR(scaled(scale * x) / scale, unscaled(x), 1e-9) << scale;
  }
}

TEST(SignCheck, comparesWithTheSumOverAllTriangles) {
  const TriangleMesh ball = shapes::mesh("builtin:sphere,subdivisions=3");
  const TriangleMesh mesh = joined(ball, moved(ball, {1, 0, 0}));
  for (const Vector3& x : placesIn(boundingBox(mesh), 50))
    EXPECT_NEAR(windingNumber(mesh, x), sumOfAngles(mesh, x), 1e-9);
  const SignCheck right = checkSign(mesh, ExactDistance(mesh), 4000);
  EXPECT_EQ(right.wrong, 0u);
  EXPECT_EQ(right.points, 4000u);
  EXPECT_LT(right.tooNear, 100u);
  // Pseudonormals are wrong inside one ball near the surface of the other ball.
  const ExactDistance byNormals(mesh, {.insideTest = InsideTest::pseudonormal});
  const SignCheck wrong = checkSign(mesh, byNormals, 4000), other = checkSign(mesh, byNormals, 4000, 2);
  EXPECT_GT(wrong.wrong, 100u);
  EXPECT_GT(wrong.worstDistance, 0.1);
  EXPECT_DOUBLE_EQ(std::abs(byNormals(wrong.worst)), wrong.worstDistance);
  EXPECT_GT(sumOfAngles(mesh, wrong.worst), 0.5);
  EXPECT_NE(wrong.worst, other.worst);
  const SignCheck alone = withThreads(1, [&] { return checkSign(mesh, byNormals, 4000); });
  EXPECT_EQ(alone.wrong, wrong.wrong);
  EXPECT_EQ(alone.worst, wrong.worst);
  // The check must not store its points: this number of points would not fit into memory.
  EXPECT_THROW(checkSign(ball, ExactDistance(ball), 1'000'000'000'000'000, 1, {{}, [] { return true; }}), Cancelled);
}

TEST(SignCheck, acceptsInwardMeshes) {
  const TriangleMesh mesh = reversed(shapes::mesh("builtin:torus,segments=48,sides=24"));
  EXPECT_EQ(checkSign(mesh, ExactDistance(mesh), 2000).wrong, 0u);
}

/// Returns a part in a box, both oriented outward. The part's largest face is `gap` away from the wall at x = 0.
TriangleMesh partBeforeWall(double gap) {
  TriangleMesh part = boxOfTwo();
  for (Vector3& v : part.vertices)
    v = v.x() < 0 ? Vector3(gap, 0.3 * v.y(), 0.3 * v.z()) : Vector3(0.6, 0.27 * v.y(), 0.27 * v.z());
  return joined(moved(boxOfTwo(), {1, 0, 0}), part);
}

TEST(InsideTest, isRightForWallsAtAnyDistance) {
  int misled = 0;
  for (const double gap : {1e-6, 1e-10, 1e-12, 1e-14, 1e-15, 1e-16, 1e-17, 1e-20}) {
    const TriangleMesh nested = partBeforeWall(gap);
    const TriangleMesh beside = joined(moved(boxOfTwo(), {1 + gap, 0, 0}), moved(boxOfTwo(), {-1, 0, 0}));
    TriangleMesh far = beside;
    for (Vector3& v : far.vertices)
      if (v.x() == 1 + gap - 1) v.x() = gap;  // 1 + gap was rounded
    for (const TriangleMesh& mesh : {nested, far}) {
      EXPECT_EQ(checkSign(mesh, ExactDistance(mesh), 3000).wrong, 0u) << gap;
      misled += checkSign(mesh, ExactDistance(mesh, {.insideTest = InsideTest::pseudonormal}), 3000).wrong > 0;
    }
  }
  EXPECT_GT(misled, 8) << "the test has no power";
}

TEST(InsideTest, isRightBesideFacesThinnerThanRounding) {
  TriangleMesh needle;
  needle.vertices = {{0.5, 0, 0}, {0.5 + 6e-8, 0, 0}, {0.5, 1e-16, 0}, {0.5, 0, 1e-16}};
  needle.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  const TriangleMesh mesh = cleaned(joined(boxOfTwo(), needle)).mesh;
  ASSERT_EQ(mesh.triangles.size(), 16u) << "the test has no power";
  const ExactDistance distance(mesh);
  EXPECT_THAT(distance.insideTestChoice().reason, testing::HasSubstr("thinner"));
  EXPECT_EQ(checkSign(mesh, distance, 3000).wrong, 0u);
  EXPECT_GT(checkSign(mesh, ExactDistance(mesh, {.insideTest = InsideTest::pseudonormal}), 3000).wrong, 0u);
}

/// The blade's sharp edge is at x = 1, along z. All points with x > 1 are outside, however near to the edge.
TEST(InsideTest, isRightBesideBlades) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1), exponent(-18, -1);
  for (const double half : {1e-13, 1e-11, 1e-9, 1e-7, 1e-5, 1e-3}) {
    const TriangleMesh blade{
        .vertices = {{1, 0, -1}, {0, half, -1}, {0, -half, -1}, {1, 0, 1}, {0, half, 1}, {0, -half, 1}},
        .triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}},
        .name = "blade"};
    const ExactDistance distance(blade);
    EXPECT_EQ(distance.insideTestChoice().insideTest, half < 1e-6 ? InsideTest::winding : InsideTest::pseudonormal)
        << half;
    std::size_t inside = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vector3 x(1 + std::pow(10, exponent(random)), 0.3 * uniform(random), 0.9 * uniform(random));
      inside += x.x() > 1 && distance(x) < 0;
    }
    EXPECT_EQ(inside, 0u) << half;
  }
}

TEST(InsideTest, ofInwardBodiesThatShareAnEdgeIsCorrectedOnImport) {
  const ImportedMesh inward = cleaned(reversed(joined(boxOfTwo(), moved(boxOfTwo(), {2, 2, 0}))));
  EXPECT_TRUE(inward.report.reversed);
  EXPECT_EQ(inward.report.unbalancedEdges, 0u);
  EXPECT_EQ(inward.report.nonManifoldEdges, 1u);
  EXPECT_LT(value(ExactDistance(inward.mesh), {0, 0, 0}), 0);
  EXPECT_GT(value(ExactDistance(inward.mesh), {3, 0, 0}), 0);
}

TEST(AngleBlock, hasTheAnglesOfItsTrianglesToTheBit) {
  std::mt19937_64 random(5);
  std::uniform_int_distribution<int> whole(-2, 2);  // many triangles without area, and points on triangles
  std::uniform_real_distribution<double> real(-2, 2);
  for (int repetition = 0; repetition < 4000; ++repetition) {
    const auto coordinate = [&](auto&) { return repetition < 2000 ? whole(random) : real(random); };
    sign::BlockAngles sum;
    std::array<sign::AngleSum, 4> single;
    const Vector3 x(coordinate(random), coordinate(random), 0.5 * (repetition % 2));
    for (int block = 0; block < 5; ++block) {
      sign::AngleBlock corners;
      for (int place = 0; place < 4; ++place) {
        std::array<Vector3, 3> v;
        for (int k = 0; k < 3; ++k)
          for (int axis = 0; axis < 3; ++axis) corners.corner[k][axis][place] = v[k][axis] = coordinate(random);
        sign::addHalfSolidAngle(v[0] - x, v[1] - x, v[2] - x, single[place]);
      }
      sign::addHalfSolidAngles(corners, x, sum);
    }
    double expected = 0;
    for (const sign::AngleSum& angles : single) expected += angles.value();
    ASSERT_EQ(sum.value(), expected) << repetition;
  }
}

TEST(AngleSum, countsTurns) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> u(-1, 1);
  sign::AngleSum sum;
  double expected = 0;
  for (int i = 0; i < 2000; ++i) {
    double x = u(random), y = u(random);
    if (i % 3 == 0) y = 0;  // an angle of 0 or 180 degrees
    if (i % 7 == 0) x = 0;
    sum.add(x, y);
    if (x != 0 || y != 0) expected += std::atan2(y, x);
    ASSERT_NEAR(sum.value(), expected, 1e-9) << i;
  }
}

/// Tests closed and broken mesh files, at fewer points than `hpsdf mesh --check-sign` takes.
TEST(InsideTest, ofMeshFilesEqualsTheWindingNumber) {
  HPSDF_SKIP_WITHOUT_MESHES();
  for (const char* name : {"cad/cube_12.obj", "cad/fandisk.obj", "cad/wingnut.obj", "cad/1002_tray_bottom.STL",
                           "paper/finger_skeletonhand_part.ply", "broken/self_intersectA.obj", "broken/teapot.obj",
                           "broken/suzanne.obj", "broken/mp_bed.obj", "broken/Generic_Twin_7081_left.obj"}) {
    const TriangleMesh mesh = importMesh(support::testMesh(name)).mesh;
    const ExactDistance distance(mesh, kAutomatic), byWinding(mesh, {.insideTest = InsideTest::winding});
    for (const Vector3& x : placesIn(boundingBox(mesh), 100)) {
      if (std::abs(distance(x)) < 1e-6 * boundingBox(mesh).sizes().maxCoeff()) continue;
      const bool inside = sumOfAngles(mesh, x) > 0.5;
      EXPECT_EQ(byWinding(x) < 0, inside) << name << " at " << x.transpose();
      EXPECT_EQ(distance(x) < 0, inside) << name << " at " << x.transpose();
    }
  }
}

}  // namespace sign_test
}  // namespace hpsdf
