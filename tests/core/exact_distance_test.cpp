#include "hpsdf/exact_distance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "bvh/triangle_frame.h"
#include "hpsdf/detail/crossings.h"
#include "hpsdf/error.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/mesh_repair.h"
#include "support/test_mesh.h"

namespace hpsdf {
namespace exact_distance_test {

using bvh::makeFrame;
using bvh::TriangleFrame;
using Triangle = std::array<Vector3, 3>;

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  Vector3 inCube(double half) { return {between(-half, half), between(-half, half), between(-half, half)}; }
  std::size_t below(std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(engine_); }
  std::mt19937_64& engine() { return engine_; }

  Vector3 onTriangle(const Triangle& corners) {
    double u = between(0, 1), v = between(0, 1);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    return corners[0] * (1 - u - v) + corners[1] * u + corners[2] * v;
  }

 private:
  std::mt19937_64 engine_;
};

Triangle cornersOf(const TriangleMesh& mesh, std::size_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  return {mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]};
}

// --- Reference distance to one triangle: by the normal equations of its plane, or to its nearest edge, with 113-bit
// --- mantissas, so that the determinant of a sliver of thickness 1e-12 keeps enough digits.

__extension__ using Quad = __float128;
using QuadVector = std::array<Quad, 3>;

QuadVector quad(const Vector3& v) { return {v[0], v[1], v[2]}; }
QuadVector plus(const QuadVector& a, Quad t, const QuadVector& b) {
  return {a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]};
}
Quad dot(const QuadVector& a, const QuadVector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Quad squaredToSegment(const QuadVector& x, const QuadVector& a, const QuadVector& b) {
  const QuadVector direction = plus(b, -1, a), from = plus(x, -1, a);
  const Quad squared = dot(direction, direction);
  const Quad t = squared > 0 ? std::clamp<Quad>(dot(from, direction) / squared, 0, 1) : 0;
  const QuadVector rest = plus(from, -t, direction);
  return dot(rest, rest);
}

double triangleReference(const Vector3& point, const Triangle& corners) {
  const QuadVector x = quad(point), a = quad(corners[0]), b = quad(corners[1]), c = quad(corners[2]);
  Quad best = std::min({squaredToSegment(x, a, b), squaredToSegment(x, b, c), squaredToSegment(x, c, a)});
  const QuadVector e = plus(b, -1, a), f = plus(c, -1, a), from = plus(x, -1, a);
  const Quad ee = dot(e, e), ef = dot(e, f), ff = dot(f, f);
  const Quad determinant = ee * ff - ef * ef;
  if (determinant > 0) {
    Quad u = 0, v = 0;
    QuadVector rest = from;
    for (int step = 0; step < 3; ++step) {  // iterative refinement, because one solution is inexact for thin triangles
      u += (ff * dot(rest, e) - ef * dot(rest, f)) / determinant;
      v += (ee * dot(rest, f) - ef * dot(rest, e)) / determinant;
      rest = plus(plus(from, -u, e), -v, f);
    }
    if (u >= 0 && v >= 0 && u + v <= 1) best = std::min(best, dot(rest, rest));
  }
  return static_cast<double>(std::sqrt(static_cast<long double>(best)));
}

double longestSide(const Triangle& t) {
  return std::sqrt(std::max({(t[0] - t[1]).squaredNorm(), (t[1] - t[2]).squaredNorm(), (t[2] - t[0]).squaredNorm()}));
}

void expectTriangleDistance(const Vector3& x, const Triangle& corners) {
  const double actual = std::sqrt(squaredDistance(makeFrame(corners, 0), x));
  const double expected = triangleReference(x, corners);
  const double size = corners[0].cwiseAbs().maxCoeff() + longestSide(corners);
  ASSERT_NEAR(actual, expected, 1e-14 * expected + 1e-15 * size)
      << "x " << x.transpose() << "\na " << corners[0].transpose() << "\nb " << corners[1].transpose() << "\nc "
      << corners[2].transpose();
}

void expectDistancesAround(const Triangle& corners, Random& random) {
  for (const double offset : {0.0, 1e-9, 1e-3, 0.3, 5.0})
    for (int i = 0; i < 20; ++i) expectTriangleDistance(random.onTriangle(corners) + random.inCube(offset), corners);
  for (int k = 0; k < 3; ++k) {
    expectTriangleDistance(corners[k], corners);
    expectTriangleDistance((corners[k] + corners[(k + 1) % 3]) / 2, corners);
  }
}

TEST(TriangleFrame, measuresDistancesToOrdinaryTriangles) {
  Random random(1);
  for (int i = 0; i < 500; ++i)
    ASSERT_NO_FATAL_FAILURE(expectDistancesAround({random.inCube(1), random.inCube(1), random.inCube(1)}, random));
}

TEST(TriangleFrame, measuresDistancesToSlivers) {
  Random random(2);
  for (const double thickness : {1e-3, 1e-5, 1e-7, 1e-9, 1e-12})
    for (int i = 0; i < 100; ++i) {
      const Vector3 a = random.inCube(1), b = random.inCube(1);
      // The apex of the sliver lies beside any position on its long side, including the ends.
      const double t = i % 4 == 0 ? 0.0 : i % 4 == 1 ? 1.0 : random.between(0, 1);
      const Vector3 c = a + t * (b - a) + thickness * random.inCube(1);
      ASSERT_NO_FATAL_FAILURE(expectDistancesAround({a, b, c}, random));
      ASSERT_NO_FATAL_FAILURE(expectDistancesAround({c, a, b}, random));
      ASSERT_NO_FATAL_FAILURE(expectDistancesAround({b, c, a}, random));
    }
}

TEST(TriangleFrame, measuresDistancesToEdgesOfDegenerateTriangles) {
  Random random(3);
  const Vector3 a(0.25, -0.5, 0.125), b(0.75, 0.5, -0.375);
  for (const Triangle& corners : {Triangle{a, b, (a + b) / 2}, Triangle{a, b, a}, Triangle{a, a, b}, Triangle{b, a, a},
                                  Triangle{a, a, a}, Triangle{Vector3::Zero(), Vector3::Zero(), Vector3::Zero()}}) {
    EXPECT_FALSE(hasArea(makeFrame(corners, 0)));
    ASSERT_NO_FATAL_FAILURE(expectDistancesAround(corners, random));
  }
}

TEST(TriangleFrame, isOrthonormalAndKeepsOrientation) {
  Random random(4);
  for (int i = 0; i < 300; ++i) {
    const Triangle corners{random.inCube(1), random.inCube(1), random.inCube(1)};
    const TriangleFrame frame = makeFrame(corners, 7);
    Eigen::Matrix3d axes;
    axes << frame.along, frame.across, frame.normal;
    EXPECT_LT((axes.transpose() * axes - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-15);
    EXPECT_GT(frame.normal.dot((corners[1] - corners[0]).cross(corners[2] - corners[0])), 0);
    EXPECT_EQ(frame.triangle, 7u);
  }
}

// --- Procedural meshes

TriangleMesh sphere(int subdivisions) {
  TriangleMesh mesh;
  mesh.name = "sphere";
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {1.0, -1.0}) mesh.vertices.push_back(sign * Vector3::Unit(axis));
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (; subdivisions > 0; --subdivisions) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, isNew] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.vertices.size()));
      if (isNew) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
      return entry->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
  }
  return mesh;
}

/// Returns a box around the origin with half edge lengths `half`; a vertex's index has one bit per axis, x first.
TriangleMesh box(const Vector3& half) {
  TriangleMesh mesh;
  mesh.name = "box";
  for (int corner = 0; corner < 8; ++corner)
    mesh.vertices.push_back(half.cwiseProduct(Vector3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1)));
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

double boxDistanceByHand(const Vector3& x, const Vector3& half) {
  const Vector3 beyond = x.cwiseAbs() - half;
  return beyond.cwiseMax(0).norm() + std::min(beyond.maxCoeff(), 0.0);
}

TriangleMesh tetrahedron(const std::array<Vector3, 4>& corners) {
  TriangleMesh mesh{{corners.begin(), corners.end()}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}, "tetrahedron"};
  if (signedVolume(mesh) < 0)
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

/// Returns true if x is inside the half-spaces of all faces. The mesh must be convex.
bool insideConvex(const TriangleMesh& mesh, const Vector3& x) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle corners = cornersOf(mesh, t);
    if ((x - corners[0]).dot((corners[1] - corners[0]).cross(corners[2] - corners[0])) > 0) return false;
  }
  return true;
}

// --- Brute force over all triangles

std::vector<TriangleFrame> framesOf(const TriangleMesh& mesh) {
  std::vector<TriangleFrame> frames;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) frames.push_back(makeFrame(cornersOf(mesh, t), t));
  return frames;
}

std::pair<double, std::uint32_t> bruteForce(const std::vector<TriangleFrame>& frames, const Vector3& x) {
  std::pair best{std::numeric_limits<double>::infinity(), std::uint32_t{0}};
  for (const TriangleFrame& frame : frames) {
    const double height = frame.normal.dot(x - frame.origin);
    if (height * height > best.first * 1.001) continue;  // even the plane is farther
    const double squared = squaredDistance(frame, x);
    if (squared < best.first) best = {squared, frame.triangle};
  }
  return best;
}

template <typename Function>
void inTwoThreads(std::size_t count, Function function) {
  const auto half = [&](std::size_t first) {
    for (std::size_t i = first; i < count; i += 2) function(i);
  };
  std::thread other(half, 1);
  half(0);
  other.join();
}

/// Uses pseudonormals as the inside test, so that meshes may be open: holes are not closed by additional surfaces.
const DistanceOptions kByNormals{.insideTest = InsideTest::pseudonormal};

void expectBruteForce(const TriangleMesh& mesh, const std::vector<Vector3>& points) {
  const ExactDistance distance(mesh, kByNormals);
  const std::vector<TriangleFrame> frames = framesOf(mesh);
  std::vector<std::pair<double, std::uint32_t>> nearest(points.size());
  inTwoThreads(points.size(), [&](std::size_t i) { nearest[i] = bruteForce(frames, points[i]); });
  std::vector<double> batch(points.size());
  distance(points, batch);
  const double rounding = 1e-15 * std::max(1.0, boundingBox(mesh).sizes().maxCoeff());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ClosestPoint closest = distance.closestPoint(points[i]);
    ASSERT_EQ(closest.triangle, nearest[i].second) << points[i].transpose();
    const double expected = std::sqrt(nearest[i].first);
    ASSERT_NEAR(std::abs(closest.signedDistance), expected, 1e-12 * expected + rounding) << points[i].transpose();
    ASSERT_EQ(std::bit_cast<std::uint64_t>(batch[i]), std::bit_cast<std::uint64_t>(closest.signedDistance));
    // The reference is computed from the triangle's corners, independently of TriangleFrame.
    const double reference = triangleReference(points[i], cornersOf(mesh, closest.triangle));
    const double coordinates = rounding + 1e-15 * points[i].cwiseAbs().maxCoeff();
    ASSERT_NEAR(std::abs(closest.signedDistance), reference, 1e-12 * reference + coordinates) << points[i].transpose();
    ASSERT_NEAR((points[i] - closest.point).norm(), reference, 1e-12 * reference + 4 * coordinates);
  }
}

/// Returns points in and around the domain, at several distances from the surface, and on faces, edges and vertices.
std::vector<Vector3> probes(const TriangleMesh& mesh, std::size_t count, std::uint64_t seed) {
  Random random(seed);
  const Box bounds = boundingBox(mesh);
  const double half = bounds.sizes().maxCoeff() / 2;
  std::vector<Vector3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const Triangle corners = cornersOf(mesh, random.below(mesh.triangles.size()));
    const Vector3 onSurface = random.onTriangle(corners);
    constexpr std::array kOffsets = {0.0, 1e-6, 0.02, 0.2};
    const std::size_t kind = i % 8;
    if (kind == 0)
      points.push_back(corners[0]);
    else if (kind == 1)
      points.push_back((corners[0] + corners[1]) / 2);
    else if (kind < 6)
      points.push_back(onSurface + random.inCube(kOffsets[kind - 2] * half));
    else
      points.push_back(bounds.center() + random.inCube((kind == 6 ? 3 : 1.1) * half));
  }
  return points;
}

TEST(ExactDistance, equalsBruteForceOnASphere) {
  const TriangleMesh mesh = sphere(4);
  ASSERT_EQ(mesh.triangles.size(), 2048u);
  expectBruteForce(mesh, probes(mesh, 4000, 10));
}

TEST(ExactDistance, approximatesTheAnalyticSphere) {
  const ExactDistance distance(sphere(5));
  Random random(11);
  for (int i = 0; i < 2000; ++i) {
    const Vector3 x = random.inCube(1.5);
    EXPECT_NEAR(distance(x), x.norm() - 1, 1e-3);  // tolerance for the sagitta of the facets
  }
}

TEST(ExactDistance, equalsBruteForceOnSoupWithSliversAndCollapsedTriangles) {
  Random random(12);
  TriangleMesh mesh;
  for (std::uint32_t t = 0; t < 600; ++t) {
    const Vector3 a = random.inCube(1);
    const Vector3 b = a + random.inCube(t % 3 == 0 ? 1 : 0.05);
    const Vector3 c = t % 5 == 0   ? Vector3((a + b) / 2)
                      : t % 5 == 1 ? Vector3(a + 1e-8 * random.inCube(1))
                      : t % 7 == 0 ? a
                                   : Vector3(a + random.inCube(0.1));
    mesh.vertices.insert(mesh.vertices.end(), {a, b, c});
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  expectBruteForce(mesh, probes(mesh, 4000, 13));
}

TEST(ExactDistance, equalsBruteForceFarFromTheOrigin) {
  TriangleMesh mesh = sphere(3);
  const ExactDistance atOrigin(mesh);
  const Vector3 shift(1e4, -2e4, 1.5e4);
  for (Vector3& vertex : mesh.vertices) vertex += shift;
  const std::vector<Vector3> points = probes(mesh, 2000, 14);
  expectBruteForce(mesh, points);
  const ExactDistance moved(mesh);
  // Coordinates of 2e4 are spaced by 4e-12: rounding decides the sign within that distance of the surface.
  for (const Vector3& x : points) EXPECT_NEAR(moved(x), atOrigin(x - shift), 2e-11);
}

TEST(ExactDistance, equalsBruteForceAtAnyScale) {
  for (const double scale : {1e-30, 1e-6, 1e6, 1e30}) {
    TriangleMesh mesh = sphere(2);
    for (Vector3& vertex : mesh.vertices) vertex *= scale;
    const ExactDistance distance(mesh);
    const std::vector<TriangleFrame> frames = framesOf(mesh);
    for (const Vector3& x : probes(mesh, 400, 15)) {
      EXPECT_EQ(distance.closestPoint(x).triangle, bruteForce(frames, x).second);
      EXPECT_NEAR(distance(x) / scale, (x / scale).norm() - 1, 0.06);
    }
  }
}

TEST(ExactDistance, equalsBruteForceFarAway) {
  const TriangleMesh mesh = sphere(2);
  const ExactDistance distance(mesh);
  Random random(16);
  for (const double far : {1e2, 1e5, 1e8, 1e20, 1e60})
    for (int i = 0; i < 50; ++i) {
      const Vector3 x = random.inCube(1).normalized() * far;
      EXPECT_NEAR(distance(x), far - 1, 1e-14 * far + 0.06);
      // Farther away, rounding hides which triangle is nearest.
      if (far > 1e8) continue;
      EXPECT_EQ(distance.closestPoint(x).triangle, bruteForce(framesOf(mesh), x).second);
    }
}

// Triangles with equal boxes, or each smaller than the previous one by a constant factor, have no good splitting plane.
// The depth of the hierarchy must stay bounded.
TEST(ExactDistance, handlesStacksOfEqualTriangles) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles.assign(200'000, {0, 1, 2});
  const ExactDistance distance(mesh, kByNormals);
  for (const Vector3& x : {Vector3(0.25, 0.25, 0.5), Vector3(-1, -1, -1), Vector3(2, 0, 0)}) {
    EXPECT_EQ(distance.closestPoint(x).triangle, 0u);
    EXPECT_NEAR(std::abs(distance(x)), triangleReference(x, cornersOf(mesh, 0)), 1e-15);
  }
}

TEST(ExactDistance, handlesTrianglesThatShrinkByAFactor) {
  TriangleMesh mesh;
  for (std::uint32_t t = 0; t < 900; ++t) {
    const double size = std::pow(0.7, t);
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back(size * (Vector3(1, 1, 1) + 0.2 * Vector3::Unit(k)));
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  expectBruteForce(mesh, probes(mesh, 2000, 17));
}

/// The centers of many triangles are so close together that dividing by their extent overflows in single precision.
TEST(ExactDistance, handlesClustersTooSmallForBinning) {
  for (const double size : {1e-37, 1e-38, 1e-39, 1e-41, 1e-44}) {
    TriangleMesh mesh;
    const auto add = [&](const Vector3& a, double length) {
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      for (const Vector3& corner : {Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)})
        mesh.vertices.push_back(a + length * corner);
      mesh.triangles.push_back({first, first + 1, first + 2});
    };
    add({-1, -1, -1}, 0.5);
    add({0.5, 0.5, 1}, 0.5);
    for (int i = 0; i < 20; ++i) add(Vector3(i, 2 * i, 0) * size, size);
    const ExactDistance distance(mesh);
    EXPECT_NEAR(std::abs(distance({0, 0, 0.25})), 0.25, 1e-12);
  }
}

TEST(ExactDistance, acceptsCoordinatesUpToTheLargest) {
  for (const double size : {1e-320, 1e-310, 1.0, 0.1 * kLargestCoordinate})
    for (const double at : {0.0, 0.9 * kLargestCoordinate}) {
      TriangleMesh mesh = sphere(2);
      for (Vector3& vertex : mesh.vertices) vertex = vertex * size + Vector3(at, -at, 0);
      EXPECT_EQ(ExactDistance(mesh).source().faces, mesh.triangles.size());
    }
  const ExactDistance large(box(Vector3::Constant(0.9 * kLargestCoordinate)));
  EXPECT_NEAR(large(Vector3::Zero()) / kLargestCoordinate, -0.9, 1e-12);
}

/// Squares of such lengths are infinite, and distances would be NaN.
TEST(ExactDistance, refusesCoordinatesBeyondTheLargest) {
  for (const double bad : {2 * kLargestCoordinate, -1e200, 1e300}) {
    TriangleMesh mesh = sphere(2);
    mesh.vertices[4].y() = bad;
    const auto refuses = [](const auto& work) {
      try {
        work();
      } catch (const Error& error) {
        return error.kind() == ErrorKind::mesh && std::string(error.what()).find("beyond 1e100") != std::string::npos;
      }
      return false;
    };
    EXPECT_TRUE(refuses([&] { ExactDistance distance(mesh); })) << bad;
    EXPECT_TRUE(refuses([&] { findCrossings(mesh); })) << bad;
    EXPECT_TRUE(refuses([&] { repaired({mesh, {}}); })) << bad;
  }
}

// --- Signs

TEST(ExactDistance, equalsTheSignedDistanceOfABox) {
  const Vector3 half(1, 0.5, 0.25);
  const ExactDistance distance(box(half));
  Random random(20);
  for (int i = 0; i < 20'000; ++i) {
    const Vector3 x = random.inCube(2).cwiseProduct(i % 2 == 0 ? half : Vector3(1, 1, 1));
    ASSERT_NEAR(distance(x), boxDistanceByHand(x, half), 1e-15) << x.transpose();
  }
}

TEST(ExactDistance, hasTheRightSignNearVerticesAndEdgesOfABox) {
  const Vector3 half(1, 0.5, 0.25);
  const TriangleMesh mesh = box(half);
  const ExactDistance distance(mesh);
  Random random(21);
  for (const double offset : {1e-1, 1e-3, 1e-6, 1e-9})
    for (int i = 0; i < 2000; ++i) {
      const Triangle corners = cornersOf(mesh, random.below(12));
      const double t = i % 2 == 0 ? 0 : random.between(0, 1);
      const Vector3 x = corners[0] + t * (corners[1] - corners[0]) + random.inCube(offset);
      const double expected = boxDistanceByHand(x, half);
      ASSERT_NEAR(distance(x), expected, 4e-16) << x.transpose();
    }
}

TEST(ExactDistance, reportsFeatureAndLowestTriangle) {
  const ExactDistance distance(box(Vector3(1, 1, 1)));
  const ClosestPoint face = distance.closestPoint({0.5, -0.25, 3});
  EXPECT_EQ(face.feature, Feature::face);
  EXPECT_EQ(face.point, Vector3(0.5, -0.25, 1));
  EXPECT_EQ(face.signedDistance, 2);
  const ClosestPoint edge = distance.closestPoint({0.5, 2, 2});
  EXPECT_EQ(edge.feature, Feature::edge);
  EXPECT_EQ(edge.point, Vector3(0.5, 1, 1));
  EXPECT_EQ(edge.triangle, 3u);  // the lower index of the edge's triangles, 3 and 6
  const ClosestPoint vertex = distance.closestPoint({-2, -2, -2});
  EXPECT_EQ(vertex.feature, Feature::vertex);
  EXPECT_EQ(vertex.point, Vector3(-1, -1, -1));
  EXPECT_EQ(vertex.triangle, 0u);
  const ClosestPoint center = distance.closestPoint({0, 0, 0});  // equally far from all twelve triangles
  EXPECT_EQ(center.triangle, 0u);
  EXPECT_EQ(center.signedDistance, -1);
}

TEST(ExactDistance, gradientsAreThoseOfTheDistance) {
  const TriangleMesh mesh = box(Vector3(1, 0.7, 0.4));
  for (const InsideTest test : {InsideTest::pseudonormal, InsideTest::winding, InsideTest::shell}) {
    const ExactDistance distance(mesh, {.insideTest = test, .thickness = test == InsideTest::shell ? 0.1 : 0});
    ASSERT_TRUE(distance.hasGradients());
    Random random(23);
    std::vector<Vector3> points(1000), gradients(points.size());
    std::vector<double> values(points.size());
    for (Vector3& x : points) x = random.inCube(1.5);
    distance.withGradients(points, values, gradients);
    int compared = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(values[i], distance(points[i]));
      EXPECT_NEAR(gradients[i].norm(), 1, 1e-12);
      constexpr double kStep = 1e-5;
      Vector3 expected;
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3 step = kStep * Vector3::Unit(axis);
        expected[axis] = (distance(points[i] + step) - distance(points[i] - step)) / (2 * kStep);
      }
      if (std::abs(expected.norm() - 1) > 1e-6) continue;  // a kink lies within the step
      EXPECT_LT((gradients[i] - expected).norm(), 1e-4) << points[i].transpose();
      ++compared;
    }
    EXPECT_GT(compared, 990);
  }
}

TEST(ExactDistance, gradientOnTheSurfaceIsItsNormal) {
  const ExactDistance distance(box(Vector3(1, 1, 1)));
  const std::vector<Vector3> points = {{0.5, -0.25, 1}, {-1, 0.125, 0.5}, {1, 0.25, 1}};
  std::vector<Vector3> gradients(points.size());
  std::vector<double> values(points.size());
  distance.withGradients(points, values, gradients);
  EXPECT_EQ(values, std::vector<double>(points.size(), 0.0));
  EXPECT_EQ(gradients[0], Vector3(0, 0, 1));
  EXPECT_EQ(gradients[1], Vector3(-1, 0, 0));
  EXPECT_EQ(gradients[2].cwiseAbs().sum(), 1);  // on an edge, the normal of one of its triangles
}

TEST(ExactDistance, hasNoGradientsWhereOtherThingsThanTrianglesAreNearest) {
  TriangleMesh open = box(Vector3(1, 1, 1));
  open.triangles.pop_back();
  EXPECT_FALSE(ExactDistance(open, {.insideTest = InsideTest::winding}).hasGradients());
  EXPECT_FALSE(ExactDistance(box(Vector3(1, 1, 1)), {.insideTest = InsideTest::outerHull}).hasGradients());
}

TEST(ExactDistance, hasTheRightSignForRandomTetrahedra) {
  Random random(22);
  for (int i = 0; i < 200; ++i) {
    const TriangleMesh mesh = tetrahedron({random.inCube(1), random.inCube(1), random.inCube(1), random.inCube(1)});
    const ExactDistance distance(mesh);
    for (int k = 0; k < 200; ++k) {
      const Vector3& corner = mesh.vertices[k % 4];
      const Vector3 x = k % 2 == 0 ? random.inCube(1.5) : Vector3(corner + random.inCube(0.01));
      const double actual = distance(x);
      if (std::abs(actual) < 1e-12) continue;
      ASSERT_EQ(actual < 0, insideConvex(mesh, x)) << x.transpose();
    }
  }
}

/// Returns a prism over a triangle. Its edge on the z axis has the dihedral angle `angle`, in radians.
TriangleMesh wedge(double angle) {
  TriangleMesh mesh;
  mesh.name = "wedge";
  for (const double z : {-1.0, 1.0})
    mesh.vertices.insert(mesh.vertices.end(), {{0, 0, z}, {1, 0, z}, {std::cos(angle), std::sin(angle), z}});
  mesh.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};
  return mesh;
}

TEST(ExactDistance, hasTheRightSignAtDihedralWedges) {
  Random random(23);
  for (const double angleDegrees : {2.0, 10.0, 45.0, 90.0, 135.0, 175.0}) {
    const TriangleMesh solid = wedge(angleDegrees * std::numbers::pi / 180);
    TriangleMesh hollow = solid;  // reversing the triangles makes the convex edges reentrant
    for (auto& triangle : hollow.triangles) std::swap(triangle[0], triangle[1]);
    const ExactDistance distance(solid), outside(hollow);
    for (int i = 0; i < 3000; ++i) {
      const Vector3 x = i % 2 == 0
                            ? Vector3(random.between(-0.1, 0.1), random.between(-0.1, 0.1), random.between(-1.2, 1.2))
                            : random.inCube(1.5);
      const double actual = distance(x);
      if (std::abs(actual) < 1e-12) continue;
      ASSERT_EQ(actual < 0, insideConvex(solid, x)) << angleDegrees << ": " << x.transpose();
      ASSERT_NEAR(outside(x), -actual, 1e-15);
    }
  }
}

// A deep notch has a reentrant apex and saddle-shaped corners, where normals of single faces give wrong signs.
TEST(ExactDistance, hasTheRightSignAtANotch) {
  TriangleMesh mesh = box(Vector3(1, 1, 1));
  mesh.vertices.push_back({0.7, 0.6, -0.9});
  std::erase_if(mesh.triangles, [](const auto& t) { return t[0] == 4 && (t[1] == 5 || (t[1] == 7 && t[2] == 6)); });
  ASSERT_EQ(mesh.triangles.size(), 10u);
  for (const auto& [a, b] : {std::pair{4u, 5u}, {5u, 7u}, {7u, 6u}, {6u, 4u}}) mesh.triangles.push_back({a, b, 8});
  TriangleMesh notch{mesh.vertices, {{4, 5, 7}, {4, 7, 6}}, "notch"};
  for (const auto& [a, b] : {std::pair{4u, 5u}, {5u, 7u}, {7u, 6u}, {6u, 4u}}) notch.triangles.push_back({b, a, 8});
  const ExactDistance distance(mesh);
  Random random(24);
  int within = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Vector3 x = i % 2 == 0 ? random.inCube(1.5) : Vector3(mesh.vertices[4 + i % 5] + random.inCube(0.2));
    const double actual = distance(x);
    if (std::abs(actual) < 1e-12) continue;
    const bool inside = x.cwiseAbs().maxCoeff() < 1 && !insideConvex(notch, x);
    within += inside;
    ASSERT_EQ(actual < 0, inside) << x.transpose();
  }
  EXPECT_GT(within, 1000);
}

TEST(ExactDistance, isPositiveZeroOnTheSurface) {
  for (const TriangleMesh& mesh : {box(Vector3(1, 0.5, 0.25)), sphere(3), wedge(0.3)}) {
    const ExactDistance distance(mesh);
    for (const Vector3& vertex : mesh.vertices) {
      const ClosestPoint closest = distance.closestPoint(vertex);
      EXPECT_EQ(closest.signedDistance, 0);
      EXPECT_FALSE(std::signbit(closest.signedDistance));
      EXPECT_EQ(closest.point, vertex);
      EXPECT_EQ(closest.feature, Feature::vertex);
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const Triangle corners = cornersOf(mesh, t);
      EXPECT_NEAR(distance((corners[0] + corners[1]) / 2), 0, 1e-15);
      EXPECT_NEAR(distance((corners[0] + corners[1] + corners[2]) / 3), 0, 1e-15);
    }
  }
  const ExactDistance flat(box(Vector3(1, 1, 1)));
  for (const Vector3& x : {Vector3(0.5, 0.25, 1), Vector3(0.5, 0.25, -1), Vector3(1, 0.5, 0.25), Vector3(0.5, -1, 0.5),
                           Vector3(0.5, 1, 1)}) {
    EXPECT_EQ(flat(x), 0);
    EXPECT_FALSE(std::signbit(flat(x)));
  }
}

// A degenerate triangle closes the mesh at a T-junction; the triangle must not affect any sign.
TEST(ExactDistance, ignoresDegenerateTrianglesForSigns) {
  const Vector3 half(1, 1, 1);
  TriangleMesh mesh = box(half);
  mesh.vertices.push_back({0, 0, 1});  // midpoint of the diagonal 4-7 of the top
  std::erase_if(mesh.triangles, [](const auto& t) { return t == std::array<std::uint32_t, 3>{4, 7, 6}; });
  mesh.triangles.push_back({4, 7, 8});
  mesh.triangles.push_back({4, 8, 6});
  mesh.triangles.push_back({8, 7, 6});
  mesh.triangles.push_back({0, 0, 5});  // degenerate: two equal corners
  std::rotate(mesh.triangles.begin(), mesh.triangles.end() - 4,
              mesh.triangles.end());  // lowest indices for the new triangles, so that they win every tie
  const ExactDistance distance(mesh);
  Random random(25);
  for (int i = 0; i < 4000; ++i) {
    const double along = random.between(-1, 1);
    const Vector3 x = i % 2 == 0 ? random.inCube(1.5) : Vector3(along, along, i % 4 == 1 ? 1.125 : 0.875);
    ASSERT_NEAR(distance(x), boxDistanceByHand(x, half), 1e-15) << x.transpose();
  }
}

TEST(ExactDistance, hasBothSignsAroundOneTriangle) {
  const ExactDistance distance(TriangleMesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, ""}, kByNormals);
  EXPECT_EQ(distance(Vector3(0.25, 0.25, 2)), 2);
  EXPECT_EQ(distance(Vector3(0.25, 0.25, -2)), -2);
  EXPECT_EQ(distance(Vector3(3, 0, 0)), 2);
}

// --- Results do not depend on how points are queried

void expectSameBits(const std::vector<double>& a, const std::vector<double>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    ASSERT_EQ(std::bit_cast<std::uint64_t>(a[i]), std::bit_cast<std::uint64_t>(b[i])) << i;
}

TEST(ExactDistance, singleBatchedShuffledAndThreadedAgreeBitForBit) {
  const TriangleMesh mesh = sphere(4);
  const ExactDistance distance(mesh);
  std::vector<Vector3> points = probes(mesh, 6000, 30);
  points.push_back(Vector3::Zero());  // nearly all triangles are equally near to the sphere's center
  std::vector<double> single;
  for (const Vector3& x : points) single.push_back(distance(x));

  std::vector<double> batch(points.size());
  distance(points, batch);
  expectSameBits(single, batch);

  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::uint64_t seed : {1u, 2u, 3u}) {
    std::mt19937_64 engine(seed);
    std::shuffle(order.begin(), order.end(), engine);
    std::vector<Vector3> shuffled;
    for (const std::size_t i : order) shuffled.push_back(points[i]);
    std::vector<double> values(points.size()), back(points.size());
    distance(shuffled, values);
    for (std::size_t i = 0; i < order.size(); ++i) back[order[i]] = values[i];
    expectSameBits(single, back);
  }

  std::vector<double> threaded(points.size());
  inTwoThreads(100, [&](std::size_t part) {
    const std::size_t begin = points.size() * part / 100, end = points.size() * (part + 1) / 100;
    distance(std::span(points).subspan(begin, end - begin), std::span(threaded).subspan(begin, end - begin));
  });
  expectSameBits(single, threaded);
}

/// Tests every instruction set of this processor, down to the scalar fallback.
TEST(ExactDistance, instructionSetsAgreeBitForBit) {
  const TriangleMesh mesh = sphere(4);
  const ExactDistance distance(mesh);
  std::vector<Vector3> points = probes(mesh, 3001, 31);
  for (const double far : {1e3, 1e8, 1e14, 1e16, 1e30, 1e200}) points.push_back(Vector3(0.3, -1, 0.2) * far);
  const auto answers = [&] {
    std::vector<double> all(points.size());
    distance(points, all);
    for (const Vector3& x : points) all.push_back(distance(x));
    std::vector<double> inParts(points.size());
    for (std::size_t first = 0, size = 1; first < points.size(); first += size, size = size % 20 + 1) {
      size = std::min(size, points.size() - first);
      distance(std::span(points).subspan(first, size), std::span(inParts).subspan(first, size));
    }
    all.insert(all.end(), inParts.begin(), inParts.end());
    return all;
  };
  const std::vector<double> best = answers();
  const auto third = std::ptrdiff_t(points.size());
  EXPECT_TRUE(std::equal(best.begin(), best.begin() + third, best.end() - third)) << "batches of 1 to 20 points";
  std::set<std::string_view> names;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(target);
    EXPECT_TRUE(names.insert(instructionSet()).second) << instructionSet();
    expectSameBits(best, answers());
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  EXPECT_GE(names.size(), 2u);
}

TEST(ExactDistance, dependsOnTheOrderOfTrianglesForTiesOnly) {
  TriangleMesh mesh = sphere(3);
  const std::vector<Vector3> points = probes(mesh, 3000, 31);
  const ExactDistance distance(mesh);
  std::mt19937_64 engine(32);
  std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), engine);
  const ExactDistance shuffled(mesh);
  for (const Vector3& x : points) EXPECT_NEAR(shuffled(x), distance(x), 1e-15);
}

TEST(ExactDistance, acceptsNonFinitePoints) {
  const ExactDistance distance(sphere(2));
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  const std::vector<Vector3> points = {{nan, 0, 0}, {2, 0, 0}, {infinity, 0, 0}, {0, -infinity, infinity}, {0, 0, 3}};
  std::vector<double> values(points.size());
  distance(points, values);
  EXPECT_TRUE(std::isnan(values[0]));
  EXPECT_EQ(values[1], 1);
  EXPECT_FALSE(std::isfinite(values[2]));
  EXPECT_FALSE(std::isfinite(values[3]));
  EXPECT_EQ(values[4], 2);
  for (int axis = 0; axis < 3; ++axis)
    for (const double bad : {nan, infinity, -infinity}) {
      Vector3 x(0.1, 0.2, 0.3);
      x[axis] = bad;
      EXPECT_FALSE(std::isfinite(distance(x))) << x.transpose();
    }
}

/// Each SIMD packet contains a NaN and a point that is very near, far or beyond single precision.
TEST(ExactDistance, nonFinitePointsDoNotAffectTheirPacket) {
  const ExactDistance distance(sphere(2));
  std::vector<Vector3> points;
  for (const double far : {1e-3, 1e10, 1e20})
    for (int nan = 0; nan < 8; ++nan) {
      for (int lane = 0; lane < 8; ++lane) points.push_back(Vector3(0.3 - 0.1 * lane, 0.2 + 0.1 * nan, 0.5));
      points[points.size() - 8 + nan][nan % 3] = std::numeric_limits<double>::quiet_NaN();
      points[points.size() - 1 - nan] *= -far;
    }
  std::vector<double> values(points.size());
  distance(points, values);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) continue;
    EXPECT_EQ(values[i], distance(points[i])) << points[i].transpose();
  }
}

// --- Properties of the ExactDistance object

TEST(ExactDistance, knowsItsSourceAndSizeAndCanBeMoved) {
  TriangleMesh mesh = sphere(2);
  ExactDistance distance(mesh);
  EXPECT_EQ(distance.source().name, "sphere");
  EXPECT_EQ(distance.source().fingerprint, fingerprint(mesh));
  EXPECT_EQ(distance.source().vertices, mesh.vertices.size());
  EXPECT_EQ(distance.source().faces, mesh.triangles.size());
  EXPECT_EQ(distance.source().box.min(), Vector3(-1, -1, -1));
  EXPECT_EQ(distance.source().box.max(), Vector3(1, 1, 1));
  EXPECT_GT(distance.bytes(), mesh.triangles.size() * 9 * sizeof(double));
  mesh = {};  // the distance must not refer to the mesh
  const ExactDistance moved = std::move(distance);
  EXPECT_EQ(moved(Vector3(3, 0, 0)), 2);
  const DistanceFunction function(moved);
  EXPECT_EQ(function.source().name, "sphere");
}

void expectError(const TriangleMesh& mesh, const std::string& part) {
  try {
    const ExactDistance distance(mesh);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr(part));
    EXPECT_THAT(error.what(), testing::HasSubstr(mesh.name));
    EXPECT_THAT(error.what(), testing::Not(testing::HasSubstr("\n")));
  }
}

TEST(ExactDistance, refusesInvalidMeshes) {
  TriangleMesh mesh = sphere(1);
  mesh.triangles.clear();
  expectError(mesh, "no faces");
  mesh = sphere(1);
  mesh.triangles[3][1] = 18;
  expectError(mesh, "vertex 19, but there are only 18");
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    mesh = sphere(1);
    mesh.vertices[4].y() = bad;
    expectError(mesh, "vertex 5 has a coordinate that is not a finite number");
  }
}

// --- Mesh files, compared with brute force at ten thousand points each

class ExactDistanceOfMeshes : public testing::TestWithParam<const char*> {};

TEST_P(ExactDistanceOfMeshes, equalsBruteForce) {
  HPSDF_SKIP_WITHOUT_MESHES();
  const TriangleMesh mesh = normalized(importMesh(support::testMesh(GetParam())).mesh);
  expectBruteForce(mesh, probes(mesh, 10'000, 40));
}

INSTANTIATE_TEST_SUITE_P(, ExactDistanceOfMeshes,
                         testing::Values("paper/bunny_69k.obj", "paper/finger_skeletonhand_part.ply",
                                         "cad/fandisk.obj"),
                         [](const auto& mesh) {
                           std::string name = mesh.param;
                           name = name.substr(name.find('/') + 1);
                           return name.substr(0, name.find('.'));
                         });

}  // namespace exact_distance_test
}  // namespace hpsdf
