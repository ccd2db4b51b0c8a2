// Tests of distances to the outer hull: the surface without the walls inside a union of overlapping bodies.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/detail/sign_check.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_file.h"
#include "support/made_meshes.h"

namespace hpsdf {
namespace hull_test {

using support::boxBetween;
using support::boxOfTwo;
using support::joined;
using support::moved;
using support::placesIn;

const DistanceOptions kHull{.insideTest = InsideTest::outerHull}, kWinding{.insideTest = InsideTest::winding};

TriangleMesh twoBalls() {
  const TriangleMesh ball = shapes::mesh("builtin:sphere,subdivisions=4");
  return joined(ball, moved(ball, {1, 0, 0}));
}

/// Returns the depth of x within the union of two unit balls whose centers are 1 apart along x: the distance to the
/// nearer outer cap, or to the circle in which the spheres intersect.
double depthInTwoBalls(const Vector3& x) {
  const double across = std::hypot(x.y(), x.z());
  double depth = std::hypot(x.x() - 0.5, across - std::sqrt(0.75));
  for (const double center : {0.0, 1.0}) {
    const Vector3 from = x - Vector3(center, 0, 0);
    const double onCap = center + from.x() / from.norm();
    if (center == 0 ? onCap <= 0.5 : onCap >= 0.5) depth = std::min(depth, 1 - from.norm());
  }
  return depth;
}

TEST(OuterHull, ofTwoBallsIsTheSurfaceOfTheirUnion) {
  const TriangleMesh mesh = twoBalls();
  const ExactDistance hull(mesh, kHull), withoutHull(mesh, kWinding);
  EXPECT_EQ(hull.source().insideTest, InsideTest::outerHull);
  EXPECT_EQ(hull.source().fingerprint, withoutHull.source().fingerprint);
  EXPECT_EQ(hull.source().faces, mesh.triangles.size());
  std::size_t inside = 0, deeper = 0;
  for (const Vector3& x : placesIn(boundingBox(mesh), 4000, 3)) {
    const double found = hull(x), before = withoutHull(x);
    ASSERT_EQ(found < 0, before < 0);
    if (found >= 0) {
      EXPECT_NEAR(found, before, 1e-12);
      continue;
    }
    ++inside;
    EXPECT_NEAR(-found, depthInTwoBalls(x),
                0.01);  // tolerance: the mesh consists of flat facets, and small pieces of inner walls remain
    if (found < before - 0.05) ++deeper;
  }
  EXPECT_GT(inside, 1000u);
  EXPECT_GT(deeper, 300u);
  EXPECT_NEAR(hull(Vector3(0.5, 0, 0)), -std::sqrt(0.75), 0.01);
  EXPECT_NEAR(withoutHull(Vector3(0.5, 0, 0)), -0.5, 0.01) << "the test has no power";
}

TEST(OuterHull, ofAMeshWithoutInnerWallsIsTheMesh) {
  const TriangleMesh mesh = shapes::mesh("builtin:gear");
  const ExactDistance hull(mesh, kHull), withoutHull(mesh);
  for (const Vector3& x : placesIn(boundingBox(mesh), 500, 3)) EXPECT_EQ(hull(x), withoutHull(x));
}

/// Two coplanar walls touch; the larger wall is subdivided along the edges of the smaller one.
TEST(OuterHull, omitsTheWallBetweenTouchingBodies) {
  const TriangleMesh mesh = joined(boxOfTwo(), moved(boxOfTwo(), {1.5, 0, 0}, 0.5));
  const ExactDistance hull(mesh, kHull), withoutHull(mesh, kWinding);
  EXPECT_EQ(withoutHull(Vector3(1, 0, 0)), 0);
  EXPECT_NEAR(hull(Vector3(1, 0, 0)), -0.5, 0.02) << "the distance is that to the side walls of the smaller box";
  EXPECT_NEAR(hull(Vector3(1, 0.7, 0)), 0, 1e-12) << "beside the smaller box the wall is outside";
  EXPECT_NEAR(hull(Vector3(1, 0.52, 0)), 0, 1e-12);
  EXPECT_NEAR(hull(Vector3(1.1, 0, 0)), -0.5, 0.02);
  EXPECT_EQ(checkSign(mesh, hull, 4000).wrong, 0u);
}

TEST(OuterHull, omitsSharedWalls) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) mesh = joined(mesh, moved(boxOfTwo(), 2 * Vector3(i & 1, i >> 1 & 1, i >> 2)));
  mesh = cleaned(mesh).mesh;
  const ExactDistance hull(mesh, kHull), withoutHull(mesh), whole(moved(boxOfTwo(), {1, 1, 1}, 2));
  for (const Vector3& x : placesIn(boundingBox(mesh), 500, 3)) EXPECT_NEAR(hull(x), whole(x), 1e-12);
  EXPECT_EQ(withoutHull(Vector3(1, 0.5, 0.2)), 0) << "the test has no power";
}

/// Where three inner walls meet, the smallest pieces still intersect other walls, but have the inside all around.
TEST(OuterHull, omitsInnerWallsWhereTheyMeet) {
  const TriangleMesh mesh = joined(joined(boxBetween({0, 0, 0}, {1, 2, 2}), boxBetween({1, 0, 0}, {2, 2, 2})),
                                   boxBetween({0, 0, 2}, {2, 2, 4}));
  const ExactDistance hull(cleaned(mesh).mesh, kHull), whole(boxBetween({0, 0, 0}, {2, 2, 4})),
      withoutHull(mesh, kWinding);
  EXPECT_EQ(withoutHull(Vector3(1, 1, 2)), 0) << "the test has no power";
  for (const Vector3& x : placesIn(boundingBox(mesh), 1000, 3)) EXPECT_NEAR(hull(x), whole(x), 0.02);
  EXPECT_NEAR(hull(Vector3(1, 1, 2)), -1, 0.02);
}

/// A triangle is not subdivided by one that touches only its boundary, however their neighbours are divided.
TEST(OuterHull, ofTouchingBodiesIsExact) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  for (const bool rotated : {false, true}) {
    TriangleMesh mesh, box = boxBetween({0, 0, 0}, {4, 4, 4});
    for (int i = 0; i < 64; ++i) {
      const Vector3 low(i % 4, i / 4 % 4, i / 16);
      const bool mirrored = (i + i / 4 + i / 16) % 2 != 0;  // mirroring exchanges the diagonals of the faces
      TriangleMesh cube = boxBetween({0, 0, 0}, {1, 1, 1});
      if (mirrored)
        for (Vector3& x : cube.vertices) x.x() = 1 - x.x();
      mesh = joined(mesh, moved(mirrored ? support::reversed(cube) : cube, low));
    }
    if (rotated)
      for (TriangleMesh* m : {&mesh, &box})
        for (Vector3& x : m->vertices) x = turn * x;
    const ExactDistance hull(mesh, kHull), whole(box), withoutHull(mesh, kWinding);
    double most = 0, innerWalls = 0;
    for (const Vector3& x : placesIn(boundingBox(mesh), 1000, 3)) {
      most = std::max(most, std::abs(hull(x) - whole(x)));
      innerWalls = std::max(innerWalls, withoutHull(x) - whole(x));
    }
    EXPECT_LT(most, 1e-9) << rotated;
    EXPECT_GT(innerWalls, 1) << "the test has no power";
  }
}

/// Between plates and in sharp wedges, points outside are closer to a piece of the surface than the piece is long.
TEST(OuterHull, outsideDistancesAreThoseToAllTriangles) {
  const TriangleMesh plates =
      joined(joined(boxBetween({0, 0, 0}, {1000, 1000, 100}), boxBetween({0, 0, 100.2}, {1000, 1000, 200})),
             boxBetween({450, 450, -10}, {550, 550, 210}));
  TriangleMesh wedge = boxBetween({-50, -50, -1}, {50, 50, 1});
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.2, Vector3(0, 1, 0.3).normalized()).toRotationMatrix();
  for (Vector3& x : wedge.vertices) x = turn * x;
  wedge = joined(boxBetween({-50, -50, -1}, {50, 50, 1}), wedge);
  for (const TriangleMesh& mesh : {plates, wedge}) {
    const ExactDistance hull(mesh, kHull), withoutHull(mesh, kWinding);
    std::vector<Vector3> points = placesIn(boundingBox(mesh), 2000, 5);
    for (int n = 0; n < 500; ++n) points.emplace_back(549.9 + 0.005 * n, 500 + 0.01 * n, 100.1);
    for (int n = 0; n < 500; ++n) points.emplace_back(5 + 0.02 * n, -25 + 0.1 * n, 1.01 + 0.002 * n);
    std::vector<double> batched(points.size());
    hull(points, batched);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double before = withoutHull(points[i]);
      if (before > 0)
        ASSERT_NEAR(batched[i], before, 1e-9) << points[i].transpose();
      else
        ASSERT_LE(batched[i], 0) << points[i].transpose();
    }
  }
}

TEST(OuterHull, keepsTrianglesThatArePartlyOutside) {
  // The long faces of the bar pass through the box.
  const TriangleMesh bar = shapes::mesh("box,width=6,height=0.5,depth=0.5");
  const ExactDistance hull(joined(boxOfTwo(), bar), kHull);
  EXPECT_NEAR(hull(Vector3(0, 0, 0)), -1, 0.02) << "the faces of the bar are 0.25 away, but within the box";
  EXPECT_NEAR(hull(Vector3(2.5, 0, 0)), -0.25, 1e-12);
  EXPECT_NEAR(hull(Vector3(2, 0.25, 0)), 0, 1e-12);
  EXPECT_NEAR(hull(Vector3(-1, 0, 0)), -0.25, 0.02) << "the bar leaves the box here";
}

TEST(OuterHull, ofOpenBodiesHasTheSignOfTheWindingNumber) {
  const TriangleMesh ball = shapes::mesh("builtin:sphere,subdivisions=3");
  const TriangleMesh mesh = joined(support::openAbove(ball, 0.8), moved(ball, {0.7, 0, 0}));
  const ExactDistance hull(mesh, kHull), withoutHull(mesh, kWinding);
  const std::vector<Vector3> points = placesIn(boundingBox(mesh), 2000, 3);
  std::vector<double> batched(points.size());
  hull(points, batched);
  std::size_t deeper = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double before = withoutHull(points[i]);
    EXPECT_EQ(batched[i], hull(points[i]));
    EXPECT_EQ(batched[i] < 0, before < 0);
    EXPECT_GT(std::abs(batched[i]), std::abs(before) - 1e-12);
    if (std::abs(batched[i]) > std::abs(before) + 0.05) ++deeper;
  }
  EXPECT_GT(deeper, 50u);
}

/// A face that no other face intersects can cross the surface that closes a hole, so that a part of it is outside.
TEST(OuterHull, keepsFacesThatPassThroughAHole) {
  const TriangleMesh blade = moved(shapes::mesh("box,width=0.4,height=0.4,depth=2.85"), {0, 0, 0.475});
  const TriangleMesh mesh = joined(support::openBox(), blade);
  const ExactDistance hull(mesh, kHull), withoutHull(mesh, kWinding);
  EXPECT_NEAR(hull(Vector3(0.21, 0, 1.4)), 0.01, 1e-12);
  EXPECT_NEAR(hull(Vector3(0.19, 0, 1.4)), -0.01, 1e-12);
  std::size_t outside = 0, deeper = 0;
  for (const Vector3& x : placesIn(boundingBox(mesh), 4000, 3)) {
    const double before = withoutHull(x), found = hull(x);
    outside += before > 0;
    if (before > 0)
      EXPECT_NEAR(found, before, 1e-9) << x.transpose();
    else
      deeper += found < before - 0.05;
  }
  EXPECT_GT(outside, 1000u);
  EXPECT_GT(deeper, 200u);
}

TEST(OuterHull, closestPointsLieOnTheirTriangles) {
  const TriangleMesh mesh = twoBalls();
  const ExactDistance hull(mesh, kHull);
  for (const Vector3& x : placesIn(boundingBox(mesh), 300, 3)) {
    const ClosestPoint closest = hull.closestPoint(x);
    ASSERT_LT(closest.triangle, mesh.triangles.size());
    const TriangleMesh one{.vertices = mesh.vertices, .triangles = {mesh.triangles[closest.triangle]}, .name = {}};
    EXPECT_NEAR(ExactDistance(one, {.insideTest = InsideTest::winding})(closest.point), 0, 1e-12);
    EXPECT_NEAR((x - closest.point).norm(), std::abs(closest.signedDistance), 1e-12);
  }
}

TEST(OuterHull, subdividesAlongTheIntersectionOnly) {
  const TriangleMesh mesh = twoBalls();
  const TriangleMesh surface = ExactDistance(mesh, kHull).surface();
  EXPECT_LT(surface.triangles.size(), 4 * mesh.triangles.size());
  const double area = 2 * (2 * std::numbers::pi * 1.5);  // two spherical caps of height 1.5
  EXPECT_NEAR(surfaceArea(surface), area, 0.02 * area);
  EXPECT_GT(surfaceArea(mesh), 1.3 * area);
  EXPECT_NEAR(surfaceArea(ExactDistance(mesh).surface()), surfaceArea(mesh), 1e-9)
      << "without a hull all triangles remain";
}

/// The construction of the hull asks thousands of times whether to cancel, in all phases of its work.
TEST(OuterHull, reportsProgressAndCanBeCancelled) {
  TriangleMesh mesh = twoBalls();
  mesh.triangles.pop_back();  // makes a hole; pieces beside it are refined
  std::map<std::string, double, std::less<>> tasks;
  std::atomic<int> asked = 0;
  const Progress telling{.report =
                             [&](std::string_view task, double fraction) {
                               EXPECT_GE(fraction, 0);
                               EXPECT_LE(fraction, 1);
                               tasks[std::string(task)] = fraction;
                             },
                         .cancelled = [&] { return ++asked < 0; }};
  const ExactDistance whole(mesh, kHull, telling);
  EXPECT_THAT(tasks, testing::Contains(testing::Pair("finding self-intersections", testing::Gt(0.9))));
  EXPECT_THAT(tasks, testing::Contains(testing::Pair("removing inner walls, pieces of 1/512", 1)));
  for (const double part : {0.0, 0.3, 0.6, 0.9}) {
    std::atomic<int> left = int(part * asked);
    EXPECT_THROW(ExactDistance(mesh, kHull, {{}, [&] { return --left < 0; }}), Cancelled) << part;
  }
}

}  // namespace hull_test
}  // namespace hpsdf
