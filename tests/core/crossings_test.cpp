// Tests of self-intersections: compared with the separating-axis theorem in integer arithmetic, and on known meshes.

#include "hpsdf/detail/crossings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/shapes.h"
#include "support/test_mesh.h"
#include "surface/crossings.h"
#include "surface/exact_orientation.h"

namespace hpsdf {
namespace crossings_test {

using IntegerPoint = std::array<std::int64_t, 3>;

IntegerPoint minus(const IntegerPoint& a, const IntegerPoint& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
std::int64_t dot(const IntegerPoint& a, const IntegerPoint& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
IntegerPoint cross(const IntegerPoint& a, const IntegerPoint& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Returns true if a plane separates two convex sets, each a triangle or a segment. By the separating-axis theorem only
/// finitely many normals have to be tried.
bool areSeparate(const std::vector<IntegerPoint>& one, const std::vector<IntegerPoint>& other) {
  std::vector<IntegerPoint> normals, edges, directions;
  for (const auto* set : {&one, &other}) {
    for (std::size_t i = 0; i < set->size(); ++i) edges.push_back(minus((*set)[(i + 1) % set->size()], (*set)[i]));
    if (set->size() == 3) normals.push_back(cross(minus((*set)[1], (*set)[0]), minus((*set)[2], (*set)[0])));
  }
  directions = edges;
  for (const IntegerPoint& n : normals) {
    directions.push_back(n);
    for (const IntegerPoint& e : edges) directions.push_back(cross(n, e));
  }
  for (const IntegerPoint& e : edges)
    for (const IntegerPoint& f : edges) directions.push_back(cross(e, f));
  return std::ranges::any_of(directions, [&](const IntegerPoint& direction) {
    const auto range = [&](const std::vector<IntegerPoint>& set) {
      std::int64_t low = INT64_MAX, high = INT64_MIN;
      for (const IntegerPoint& x : set) {
        low = std::min(low, dot(direction, x));
        high = std::max(high, dot(direction, x));
      }
      return std::pair(low, high);
    };
    const auto [low, high] = range(one);
    const auto [otherLow, otherHigh] = range(other);
    return high < otherLow || otherHigh < low;
  });
}

Vector3 inSpace(const IntegerPoint& x) { return {double(x[0]), double(x[1]), double(x[2])}; }

TriangleMesh meshOf(const std::vector<IntegerPoint>& corners, std::array<std::uint32_t, 3> second) {
  TriangleMesh mesh;
  for (const IntegerPoint& x : corners) mesh.vertices.push_back(inSpace(x));
  mesh.triangles = {{0, 1, 2}, second};
  return mesh;
}

/// Pairs of triangles with corners on a small grid, where points are often collinear or coplanar.
class GridPairs {
 public:
  IntegerPoint point() {
    std::uniform_int_distribution<std::int64_t> whole(0, 3);
    const std::int64_t x = whole(random_), y = whole(random_), z = whole(random_);
    return {x, y, z};
  }

  /// Returns different grid points. The first three, and the three with the indices `second`, form proper triangles.
  std::vector<IntegerPoint> points(std::size_t count, std::array<std::uint32_t, 3> second) {
    for (;;) {
      std::vector<IntegerPoint> all;
      while (all.size() < count) {
        const IntegerPoint x = point();
        if (std::ranges::find(all, x) == all.end()) all.push_back(x);
      }
      const auto hasArea = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        return cross(minus(all[b], all[a]), minus(all[c], all[a])) != IntegerPoint{0, 0, 0};
      };
      if (hasArea(0, 1, 2) && hasArea(second[0], second[1], second[2])) return all;
    }
  }

 private:
  std::mt19937_64 random_{7};
};

bool intersects(const TriangleMesh& mesh) { return !findCrossings(mesh).found.empty(); }

/// Compares `findCrossings` with `expected` on random pairs of triangles: one has the first three of `count` points as
/// corners, the other one the points with the indices `second`. Returns the number of pairs that intersect.
template <typename Expected>
int countIntersecting(std::size_t count, std::array<std::uint32_t, 3> second, const Expected& expected) {
  GridPairs pairs;
  int intersecting = 0;
  for (int i = 0; i < 20'000 && !testing::Test::HasFailure(); ++i) {
    const std::vector<IntegerPoint> x = pairs.points(count, second);
    const bool isExpected = expected(x);
    EXPECT_EQ(intersects(meshOf(x, second)), isExpected) << i;
    intersecting += isExpected;
  }
  return intersecting;
}

TEST(Crossings, ofTrianglesWithoutSharedCornersAreThoseThatNoPlaneSeparates) {
  const int intersecting = countIntersecting(6, {3, 4, 5}, [](const auto& x) {
    return !areSeparate({x[0], x[1], x[2]}, {x[3], x[4], x[5]});
  });
  EXPECT_GT(intersecting, 4000);
  EXPECT_LT(intersecting, 16'000);
}

TEST(Crossings, ofNeighboursAtACornerAreBeyondIt) {
  const int intersecting = countIntersecting(5, {3, 1, 4}, [](const auto& x) {
    return !areSeparate({x[0], x[2]}, {x[3], x[1], x[4]}) || !areSeparate({x[3], x[4]}, {x[0], x[1], x[2]});
  });
  EXPECT_GT(intersecting, 2000);
  EXPECT_LT(intersecting, 18'000);
}

TEST(Crossings, ofNeighboursAtAnEdgeAreFoldedFlat) {
  const int intersecting = countIntersecting(4, {2, 1, 3}, [](const auto& x) {
    const IntegerPoint side = minus(x[2], x[1]), normal = cross(side, minus(x[0], x[1]));
    const bool flat = dot(normal, minus(x[3], x[1])) == 0;
    return flat && dot(cross(side, minus(x[3], x[1])), normal) > 0;
  });
  EXPECT_GT(intersecting, 200);
}

TEST(Crossings, areDecidedWithoutRounding) {
  // Three points far from the origin span a plane; points are tested one unit in the last place above, in and below it.
  const Vector3 a(1e6, 1e6 + 1, 1e6), b(1e6 + 3, 1e6, 1e6 + 1), c(1e6 + 1, 1e6 + 5, 1e6 + 2);
  const Vector3 inPlane = a + 0.5 * (b - a) + 0.25 * (c - a);  // exact, because each coordinate is a multiple of 1/4
  EXPECT_EQ(surface::orientation(a, b, c, inPlane), 0);
  for (int k = 0; k < 3; ++k) {
    Vector3 above = inPlane, below = inPlane;
    above[k] = std::nextafter(above[k], HUGE_VAL);
    below[k] = std::nextafter(below[k], -HUGE_VAL);
    EXPECT_EQ(surface::orientation(a, b, c, above) * surface::orientation(a, b, c, below), -1) << k;
    EXPECT_EQ(surface::orientation(a, b, c, above), (b - a).cross(c - a)[k] > 0 ? 1 : -1) << k;
    EXPECT_EQ(surface::orientation(b, a, c, above), -surface::orientation(a, b, c, above)) << k;
  }
  EXPECT_EQ(surface::orientation(std::array{0, 1}, a, b, Vector3(a + 0.5 * (b - a))), 0);
}

TEST(Crossings, doNotExistInEmbeddedMeshes) {
  for (const char* shape : {"builtin:gear", "builtin:torus", "builtin:box", "builtin:sphere"}) {
    const Crossings crossings = findCrossings(shapes::mesh(shape));
    EXPECT_TRUE(crossings.found.empty()) << shape;
    EXPECT_TRUE(crossings.complete);
  }
}

/// Two spheres that intersect each other.
TriangleMesh lens() {
  TriangleMesh mesh = shapes::mesh("builtin:sphere,subdivisions=3");
  const auto count = static_cast<std::uint32_t>(mesh.vertices.size());
  const auto faces = mesh.triangles;
  for (std::uint32_t v = 0; v < count; ++v) mesh.vertices.push_back(mesh.vertices[v] + Vector3(1, 0.01, 0.02));
  for (const auto& [a, b, c] : faces) mesh.triangles.push_back({a + count, b + count, c + count});
  return mesh;
}

TEST(Crossings, lieWhereTheSpheresIntersect) {
  const TriangleMesh mesh = lens();
  const auto half = static_cast<std::uint32_t>(mesh.triangles.size() / 2);
  const Crossings crossings = findCrossings(mesh);
  EXPECT_TRUE(crossings.complete);
  EXPECT_GT(crossings.found.size(), 50u);
  for (const Crossing& crossing : crossings.found) {
    EXPECT_LT(crossing.triangles[0], half);
    EXPECT_GE(crossing.triangles[1], half);
    EXPECT_NEAR(crossing.position.x(), 0.5, 0.15);
  }
  EXPECT_TRUE(std::ranges::is_sorted(crossings.found, {}, &Crossing::triangles));
}

TEST(Crossings, doNotDependOnThreadsAndObeyTheLimit) {
  const TriangleMesh mesh = lens();
  const auto trianglesOf = [&](int threads, std::size_t limit) {
    const Crossings crossings = withThreads(threads, [&] { return findCrossings(mesh, limit); });
    std::vector<std::array<std::uint32_t, 2>> triangles;
    for (const Crossing& crossing : crossings.found) triangles.push_back(crossing.triangles);
    EXPECT_EQ(crossings.complete, limit > 1000);
    return triangles;
  };
  const auto all = trianglesOf(1, 1'000'000);
  EXPECT_EQ(all, trianglesOf(4, 1'000'000));
  ASSERT_GT(all.size(), 100u);
  for (const std::size_t limit : {std::size_t{1}, std::size_t{2}, std::size_t{10}, all.size() - 1}) {
    const auto some = trianglesOf(1, limit);
    EXPECT_EQ(some, trianglesOf(3, limit));
    EXPECT_EQ(some.size(), limit);
    EXPECT_TRUE(std::ranges::includes(all, some));
  }
}

TEST(Crossings, ofChosenTrianglesAreThoseWithOneOfThem) {
  const TriangleMesh mesh = lens();
  const Crossings all = findCrossings(mesh);
  std::mt19937 random(11);
  for (const int share : {0, 3, 40, 100}) {  // percent
    std::vector<bool> chosen(mesh.triangles.size());
    for (std::size_t i = 0; i < chosen.size(); ++i) chosen[i] = static_cast<int>(random() % 100) < share;
    std::vector<std::array<std::uint32_t, 2>> expected, found;
    for (const auto& [triangles, point] : all.found)
      if (chosen[triangles[0]] || chosen[triangles[1]]) expected.push_back(triangles);
    const Crossings some = surface::findCrossingsOf(mesh, chosen, kMaxCrossings, {});
    for (const Crossing& crossing : some.found) found.push_back(crossing.triangles);
    EXPECT_EQ(found, expected) << share;
    EXPECT_TRUE(some.complete);
    EXPECT_EQ(surface::findCrossingsOf(mesh, chosen, 5, {}).complete, expected.size() <= 5);
  }
}

TEST(Crossings, areFoundAtAnyScale) {
  for (const double scale : {1e-90, 1e-20, 1e20, 1e90}) {
    TriangleMesh mesh = lens();
    const std::size_t count = findCrossings(mesh).found.size();
    for (Vector3& x : mesh.vertices) x *= scale;
    EXPECT_NEAR(double(findCrossings(mesh).found.size()), double(count), 4) << scale;
    EXPECT_NEAR(findCrossings(mesh).found[0].position.x() / scale, 0.5, 0.15);
  }
}

TEST(Crossings, ofDuplicateTrianglesAreFoundUnlessDegenerate) {
  EXPECT_TRUE(intersects(meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 2, 1})));
  EXPECT_FALSE(intersects(meshOf({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {0, 2, 1}))) << "without area";
}

TEST(Crossings, doNotExistInASingleTriangle) {
  EXPECT_TRUE(findCrossings({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, "one"}).found.empty());
}

TEST(Crossings, canBeCancelled) {
  std::atomic<int> left = 100;
  EXPECT_THROW(findCrossings(lens(), kMaxCrossings, {{}, [&] { return --left < 0; }}), Cancelled);
}

TEST(Crossings, refuseAnEmptyMesh) { EXPECT_THROW(findCrossings({}), Error); }

TEST(Crossings, ofMeshFilesAreAsKnown) {
  HPSDF_SKIP_WITHOUT_MESHES();
  const auto crossings = [](const char* file) { return findCrossings(importMesh(support::testMesh(file)).mesh); };
  EXPECT_TRUE(crossings("paper/bunny_69k.obj").found.empty());
  EXPECT_FALSE(crossings("broken/self_intersectA.obj").found.empty());
}

}  // namespace crossings_test
}  // namespace hpsdf
