#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"
#include "support/made_meshes.h"
#include "support/winding_by_hand.h"

namespace hpsdf {
namespace closest_point_test {

using support::boxBetween;
using support::joined;
using support::placesIn;

TriangleMesh twoBoxes() {
  return joined(boxBetween({-1, -1, -1}, {0.5, 1, 1}), boxBetween({-0.4, -0.7, -0.6}, {1, 0.8, 0.7}));
}

/// Returns points around a mesh, at its vertices and edges, and on its faces.
std::vector<Vector3> pointsOf(const TriangleMesh& mesh) {
  const Box box = boundingBox(mesh);
  std::vector<Vector3> points = placesIn(Box(box.min() - 0.3 * box.sizes(), box.max() + 0.3 * box.sizes()), 3001);
  for (std::size_t i = 0; i < mesh.triangles.size() && i < 200; ++i) {
    const auto [a, b, c] = cornersOf(mesh, mesh.triangles[i]);
    const Vector3 outward = (b - a).cross(c - a).normalized();
    for (const Vector3& x : {a, Vector3((a + b) / 2), Vector3((a + b + c) / 3)}) {
      points.push_back(x);
      points.emplace_back(x + 0.01 * outward);
    }
  }
  return points;
}

struct Case {
  TriangleMesh mesh;
  DistanceOptions options;
};

std::vector<Case> cases() {
  return {{shapes::mesh("gear"), {}},
          {shapes::mesh("gear"), {.insideTest = InsideTest::winding}},
          {shapes::mesh("torus"), {.insideTest = InsideTest::shell, .thickness = 0.05}},
          {support::openBox(), {}},
          {twoBoxes(), {}},
          {twoBoxes(), {.insideTest = InsideTest::outerHull}}};
}

TEST(ClosestPoint, isTheSameAloneAndInBatches) {
  for (const auto& [mesh, options] : cases()) {
    const ExactDistance distance(mesh, options);
    const std::vector<Vector3> points = pointsOf(mesh);
    std::vector<ClosestPoint> found(points.size());
    std::vector<double> distances(points.size());
    distance.closestPoints(points, found);
    distance(points, distances);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ClosestPoint alone = distance.closestPoint(points[i]);
      ASSERT_EQ(found[i].signedDistance, distances[i]) << points[i].transpose();
      ASSERT_EQ(found[i].signedDistance, alone.signedDistance);
      ASSERT_EQ(found[i].point, alone.point);
      ASSERT_EQ(found[i].triangle, alone.triangle);
      ASSERT_EQ(found[i].feature, alone.feature);
      ASSERT_EQ(found[i].featureIndex, alone.featureIndex);
      ASSERT_EQ(found[i].barycentric, alone.barycentric);
    }
  }
}

TEST(ClosestPoint, isTheWeightedSumOfItsTrianglesCorners) {
  for (const auto& [mesh, options] : cases()) {
    const ExactDistance distance(mesh, options);
    std::array<int, 3> features = {};
    for (const Vector3& x : pointsOf(mesh)) {
      const ClosestPoint found = distance.closestPoint(x);
      const auto [a, b, c] = cornersOf(mesh, mesh.triangles.at(found.triangle));
      const Vector3& weights = found.barycentric;
      EXPECT_NEAR(weights.sum(), 1, 1e-15);
      EXPECT_GE(weights.minCoeff(), 0);
      EXPECT_LT((weights[0] * a + weights[1] * b + weights[2] * c - found.point).norm(), 1e-14) << x.transpose();
      const int k = found.featureIndex;
      ++features[std::size_t(found.feature)];
      const bool agrees = found.feature == Feature::face   ? k == 0
                          : found.feature == Feature::edge ? weights[(k + 2) % 3] == 0
                                                           : weights[k] == 1;
      EXPECT_TRUE(agrees) << x.transpose() << ": " << weights.transpose();
    }
    for (const int count : features) EXPECT_GT(count, 10);
  }
}

TEST(ClosestPoint, namesTheCornersOfEdgesAndVertices) {
  const TriangleMesh mesh = {.vertices = {{0, 0, 0}, {4, 0, 0}, {0, 2, 0}}, .triangles = {{0, 1, 2}}, .name = {}};
  const ExactDistance distance(mesh, {.insideTest = InsideTest::shell, .thickness = 0.1});
  const auto expect = [&](const Vector3& x, Feature feature, int index, const Vector3& weights) {
    const ClosestPoint found = distance.closestPoint(x);
    EXPECT_EQ(found.feature, feature) << x.transpose();
    EXPECT_EQ(found.featureIndex, index) << x.transpose();
    EXPECT_LT((found.barycentric - weights).norm(), 1e-15) << found.barycentric.transpose();
  };
  expect({1, 0.5, 3}, Feature::face, 0, {0.5, 0.25, 0.25});
  expect({1, -2, 1}, Feature::edge, 0, {0.75, 0.25, 0});
  expect({4, 5, 1}, Feature::edge, 1, {0, 0.5, 0.5});
  expect({-1, 0.5, 0}, Feature::edge, 2, {0.75, 0, 0.25});
  expect({-1, -1, 0}, Feature::vertex, 0, {1, 0, 0});
  expect({9, 0, 0}, Feature::vertex, 1, {0, 1, 0});
  expect({0, 9, 2}, Feature::vertex, 2, {0, 0, 1});
}

TEST(WindingNumber, isTheSumOfSolidAnglesForAnyInsideTest) {
  for (const auto& [mesh, options] : cases()) {
    const ExactDistance distance(mesh, options);
    const Box box = boundingBox(mesh);
    const std::vector<Vector3> points =
        placesIn(Box(box.min() - 0.2 * box.sizes(), box.max() + 0.2 * box.sizes()), 100);
    std::vector<double> found(points.size());
    distance.windingNumbers(points, found);
    const bool isClosed = mesh.triangles.size() != support::openBox().triangles.size();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double expected = support::windingByHand(mesh, points[i]);
      EXPECT_NEAR(found[i], expected, ExactDistance::kWindingError) << points[i].transpose();
      EXPECT_TRUE(!isClosed || found[i] == std::round(expected));
      EXPECT_EQ(distance.windingNumber(points[i]), found[i]);
    }
  }
}

TEST(WindingNumber, countsOverlappingBodiesAndReversedOnes) {
  const TriangleMesh mesh = twoBoxes();
  EXPECT_EQ(ExactDistance(mesh).windingNumber({0, 0, 0}), 2);
  EXPECT_EQ(ExactDistance(mesh).windingNumber({0.9, 0, 0}), 1);
  EXPECT_EQ(ExactDistance(mesh).windingNumber({3, 0, 0}), 0);
  EXPECT_EQ(ExactDistance(mesh, {.insideTest = InsideTest::outerHull}).windingNumber({0, 0, 0}), 2);
  EXPECT_EQ(ExactDistance(support::reversed(support::boxOfTwo())).windingNumber({0, 0, 0}), -1);
}

TEST(WindingNumber, isZeroFarAwayAndAtPointsThatAreNotFinite) {
  for (const TriangleMesh& mesh : {support::boxOfTwo(), support::openBox()}) {
    const ExactDistance distance(mesh);
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (const double x : {1e15, 1e100, 1e300, kInfinity, std::nan("")})
      EXPECT_EQ(distance.windingNumber({x, 0, 1}), 0);
    EXPECT_NEAR(distance.windingNumber({1e9, 0, 0}), 0, 1e-15);
  }
}

/// An object whose inside test needs no winding numbers prepares them when they are asked for, once for all threads.
TEST(WindingNumber, isPreparedAtTheFirstCallByAnyThread) {
  const ExactDistance distance(shapes::mesh("torus"));
  ASSERT_EQ(distance.insideTestChoice().insideTest, InsideTest::pseudonormal);
  const std::size_t before = distance.bytes();
  EXPECT_EQ(ExactDistance(shapes::mesh("torus")).bytes(), before);
  const std::vector<Vector3> points = placesIn(boundingBox(shapes::mesh("torus")), 2000);
  std::vector<double> found(points.size());
  tbb::parallel_for(std::size_t{0}, points.size(),
                    [&](std::size_t i) { found[i] = distance.windingNumber(points[i]); });
  for (std::size_t i = 0; i < points.size(); ++i) ASSERT_EQ(found[i], distance(points[i]) < 0 ? 1 : 0);
  const double perTriangle = double(distance.bytes() - before) / double(distance.source().faces);
  EXPECT_GT(perTriangle, 100);
  EXPECT_LT(perTriangle, 300);
}

/// Returns points in random directions at a distance from the origin.
std::vector<Vector3> pointsAt(double distance) {
  std::vector<Vector3> points = placesIn(Box(Vector3::Constant(-1), Vector3::Constant(1)), 300);
  for (Vector3& x : points) x = x.normalized() * distance;
  return points;
}

TEST(ClosestPoint, hasTheRightSignAndDistanceFarAway) {
  std::vector<Case> all = cases();
  all.push_back({support::reversed(shapes::mesh("gear")), {}});
  // From a thousand times their size on, the two faces of this wall are equally far to rounding.
  all.push_back({boxBetween({-1, -1, -1e-13}, {1, 1, 1e-13}), {}});
  for (const auto& [mesh, options] : all) {
    const ExactDistance distance(mesh, options);
    const double side = signedVolume(mesh) < 0 ? -1 : 1, size = boundingBox(mesh).sizes().norm();
    for (const double away : {1e3, 1e7, 1e9, 1e12, 1e15, 1e20, 1e100, 1e200, 1e307}) {
      const std::vector<Vector3> points = pointsAt(away);
      std::vector<ClosestPoint> found(points.size());
      std::vector<double> distances(points.size()), windings(points.size());
      distance.closestPoints(points, found);
      distance(points, distances);
      distance.windingNumbers(points, windings);
      for (std::size_t i = 0; i < points.size(); ++i) {
        ASSERT_NEAR(distances[i] * side, away, size + 1e-15 * away) << points[i].transpose();
        ASSERT_EQ(found[i].signedDistance, distances[i]);
        ASSERT_EQ(distance(points[i]), distances[i]);
        ASSERT_NEAR((points[i] - found[i].point).stableNorm() - options.thickness / 2, distances[i] * side,
                    1e-7 * size + 1e-15 * away);
        ASSERT_NEAR(windings[i], 0, 1e-4);
      }
    }
  }
}

TEST(ClosestPoint, isTheFarthestVertexOfAGearInTheDirectionOfAFarPoint) {
  const TriangleMesh mesh = shapes::mesh("gear");
  const ExactDistance distance(mesh);
  for (const double away : {1e5, 1e9, 1e15, 1e30})
    for (const Vector3& x : pointsAt(away)) {
      const Vector3 direction = x.normalized();
      double farthest = -HUGE_VAL;
      for (const Vector3& vertex : mesh.vertices) farthest = std::max(farthest, direction.dot(vertex));
      ASSERT_NEAR(direction.dot(distance.closestPoint(x).point), farthest, 1e-4) << x.transpose();
    }
}

TEST(ClosestPoint, gradientsAreUnitVectorsToFarPoints) {
  for (const auto& [mesh, options] : cases()) {
    const ExactDistance distance(mesh, options);
    if (!distance.hasGradients()) continue;
    for (const double away : {1e9, 1e15, 1e100, 1e300}) {
      const std::vector<Vector3> points = pointsAt(away);
      std::vector<double> distances(points.size());
      std::vector<Vector3> gradients(points.size());
      distance.withGradients(points, distances, gradients);
      for (std::size_t i = 0; i < points.size(); ++i)
        ASSERT_NEAR((gradients[i] - points[i] / away).norm(), 0, 1e-8) << points[i].transpose();
    }
  }
}

}  // namespace closest_point_test
}  // namespace hpsdf
