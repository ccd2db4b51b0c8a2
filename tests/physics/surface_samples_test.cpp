#include "hpsdf/physics/surface_samples.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"

namespace hpsdf::physics {
namespace surface_samples_test {

/// Returns each sample's distance to the nearest other sample that faces the same way.
std::vector<double> nearest(const SurfaceSamples& samples) {
  std::vector<double> result(samples.size(), std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < samples.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      if (samples.normals()[i].dot(samples.normals()[j]) < 0) continue;
      const double distance = (samples.points()[i] - samples.points()[j]).norm();
      result[i] = std::min(result[i], distance);
      result[j] = std::min(result[j], distance);
    }
  return result;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double x : values) sum += x;
  return sum / double(values.size());
}

/// Returns the neighbour distance of the densest (hexagonal) packing, which no set of points can exceed.
double idealDistance(double area, std::size_t count) {
  return std::sqrt(2 * area / (std::numbers::sqrt3 * double(count)));
}

std::string refusal(const TriangleMesh& mesh, const SampleOptions& options) {
  try {
    sampleSurface(mesh, options);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

class Samples : public testing::TestWithParam<const char*> {};

// For random points, the mean nearest distance would be 0.47 and the least one 0.01 of the ideal distance.
TEST_P(Samples, areEven) {
  const TriangleMesh mesh = shapes::mesh(GetParam());
  const SurfaceSamples samples = sampleSurface(mesh, {.count = 3000});
  ASSERT_EQ(samples.size(), 3000u);
  const double ideal = idealDistance(surfaceArea(mesh), samples.size());
  const std::vector<double> distances = nearest(samples);
  RecordProperty("mean", std::to_string(mean(distances) / ideal));
  RecordProperty("least", std::to_string(*std::ranges::min_element(distances) / ideal));
  EXPECT_GT(mean(distances), 0.75 * ideal);
  EXPECT_GT(*std::ranges::min_element(distances), 0.55 * ideal);
}

// In the densest packing, the center of the widest hole is 0.58 ideal distances away from the nearest sample.
TEST_P(Samples, leaveNoHoles) {
  const TriangleMesh mesh = shapes::mesh(GetParam());
  const SurfaceSamples samples = sampleSurface(mesh, {.count = 1000});
  const SurfaceSamples places = sampleSurface(mesh, {.count = 5000, .seed = 77});
  const double ideal = idealDistance(surfaceArea(mesh), samples.size());
  for (const Vector3& place : places.points()) {
    double least = std::numeric_limits<double>::infinity();
    for (const Vector3& x : samples.points()) least = std::min(least, (x - place).norm());
    ASSERT_LT(least, 1.1 * ideal);
  }
}

TEST_P(Samples, lieOnTheSurfaceAndFaceOutwards) {
  const TriangleMesh mesh = shapes::mesh(GetParam());
  const SurfaceSamples samples = sampleSurface(mesh, {.count = 1000});
  const ExactDistance distance(mesh);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_LT(std::abs(distance(samples.points()[i])), 1e-12);
    ASSERT_NEAR(samples.normals()[i].norm(), 1, 1e-12);
    ASSERT_NEAR(distance(samples.points()[i] + 1e-6 * samples.normals()[i]), 1e-6, 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, Samples, testing::Values("sphere", "torus", "gear"),
                         [](const auto& shape) { return std::string(shape.param); });

TEST(SurfaceSamples, ofAThinWallAreEvenOnEachSide) {
  const TriangleMesh mesh = shapes::mesh("box,width=1,height=1,depth=0.002");
  const SurfaceSamples samples = sampleSurface(mesh, {.count = 2000});
  const auto above = std::ranges::count_if(samples.points(), [](const Vector3& x) { return x.z() > 0; });
  EXPECT_NEAR(double(above), 1000, 30);
  EXPECT_GT(mean(nearest(samples)), 0.75 * idealDistance(surfaceArea(mesh), samples.size()));
}

TEST(SurfaceSamples, bySpacingAreAsManyAsSquaresOfThatSide) {
  const TriangleMesh mesh = shapes::mesh("box,width=2,height=3,depth=4");
  const SurfaceSamples samples = sampleSurface(mesh, {.spacing = 0.2});
  EXPECT_EQ(samples.size(), std::size_t(52 / 0.04));
  EXPECT_NEAR(mean(nearest(samples)), 0.85 * 0.2, 0.01);
  EXPECT_EQ(sampleSurface(mesh, {.spacing = 100}).size(), 1u);
}

TEST(SurfaceSamples, areTheSameForTheSameSeed) {
  const TriangleMesh mesh = shapes::mesh("gear");
  const auto sample = [&](std::uint64_t seed) { return sampleSurface(mesh, {.count = 500, .seed = seed}); };
  const SurfaceSamples one = sample(1), again = sample(1), other = sample(2);
  EXPECT_TRUE(std::ranges::equal(one.points(), again.points()));
  EXPECT_TRUE(std::ranges::equal(one.normals(), again.normals()));
  EXPECT_FALSE(std::ranges::equal(one.points(), other.points()));
}

TEST(SurfaceSamples, areFewIfAskedFor) {
  for (const std::size_t count : {1, 2, 3, 17}) {
    const SurfaceSamples samples = sampleSurface(shapes::mesh("torus"), {.count = count});
    EXPECT_EQ(samples.size(), count);
    EXPECT_EQ(samples.spheres()[0].end, count);
  }
}

/// Checks a node and its subtree recursively; returns the first node behind the subtree.
std::uint32_t checkSubtree(const SurfaceSamples& samples, std::uint32_t node) {
  const Sphere& sphere = samples.spheres()[node];
  double widest = 0;
  for (std::uint32_t i = sphere.begin; i < sphere.end; ++i) {
    EXPECT_LE((samples.points()[i] - sphere.center).norm(), sphere.radius);
    for (std::uint32_t j = sphere.begin; j < i; ++j)
      widest = std::max(widest, (samples.points()[i] - samples.points()[j]).norm());
  }
  EXPECT_LE(sphere.radius, 1.03 * std::sqrt(3.0 / 8) * widest)
      << "of any points the smallest sphere is within this (Jung)";
  std::uint32_t at = node + 1, held = sphere.begin;
  while (at < sphere.next) {
    EXPECT_EQ(samples.spheres()[at].begin, held);
    held = samples.spheres()[at].end;
    at = checkSubtree(samples, at);
  }
  EXPECT_EQ(at, sphere.next);
  EXPECT_EQ(held, sphere.next == node + 1 ? sphere.begin : sphere.end) << "children share the samples out";
  EXPECT_TRUE(sphere.next > node + 1 || sphere.end - sphere.begin <= 16);
  return at;
}

TEST(SurfaceSamples, lieInTightSpheres) {
  for (const char* shape : {"torus", "gear", "box,width=4,height=1,depth=0.1"}) {
    const SurfaceSamples samples = sampleSurface(shapes::mesh(shape), {.count = 700});
    EXPECT_EQ(samples.spheres()[0].begin, 0u);
    EXPECT_EQ(samples.spheres()[0].end, 700u);
    EXPECT_EQ(checkSubtree(samples, 0), samples.spheres().size());
  }
}

TEST(SurfaceSamples, lieInTheSmallestSphere) {
  const SurfaceSamples samples = sampleSurface(shapes::mesh("sphere,radius=0.5"), {.count = 2000});
  EXPECT_NEAR(samples.spheres()[0].radius, 0.5, 0.01);
  EXPECT_LT(samples.spheres()[0].center.norm(), 0.01);
}

TEST(SurfaceSamples, ofAnyPoints) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Vector3> points(100), normals(100, Vector3::UnitZ());
  for (Vector3& x : points) x = {uniform(random), uniform(random), uniform(random)};
  points[7] = points[8] = points[9];
  const SurfaceSamples samples(points, normals);
  checkSubtree(samples, 0);
  const auto less = [](const Vector3& a, const Vector3& b) { return std::ranges::lexicographical_compare(a, b); };
  std::vector<Vector3> kept(samples.points().begin(), samples.points().end());
  std::ranges::sort(points, less);
  std::ranges::sort(kept, less);
  EXPECT_EQ(kept, points);

  EXPECT_THROW(SurfaceSamples({}, {}), Error);
  EXPECT_THROW(SurfaceSamples(points, std::span(normals).first(3)), Error);
  points[5].y() = std::nan("");
  EXPECT_THROW(SurfaceSamples(points, normals), Error);
}

TEST(SurfaceSamples, refuseMeshesThatGiveNone) {
  const TriangleMesh torus = shapes::mesh("torus");
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_THAT(refusal(torus, {}), testing::HasSubstr("either their count or their spacing"));
  EXPECT_THAT(refusal(torus, {.count = 5, .spacing = 0.1}), testing::HasSubstr("either"));
  EXPECT_THAT(refusal(torus, {.count = 0}), testing::HasSubstr("1 or more"));
  EXPECT_THAT(refusal(torus, {.count = kMaxSamples + 1}), testing::HasSubstr("give a lower count"));
  EXPECT_THAT(refusal(torus, {.count = std::numeric_limits<std::size_t>::max()}), testing::HasSubstr("lower count"));
  for (const double spacing : {0.0, -1.0, infinity, std::nan("")})
    EXPECT_THAT(refusal(torus, {.spacing = spacing}), testing::HasSubstr("above 0")) << spacing;
  for (const double spacing : {1e-9, 1e-300})
    EXPECT_THAT(refusal(torus, {.spacing = spacing}), testing::HasSubstr("greater spacing")) << spacing;

  EXPECT_EQ(refusal({{}, {}, "no.obj"}, {.count = 5}), "no.obj: has no triangles to take samples of");
  TriangleMesh bad = torus;
  bad.triangles[3][1] = 1u << 30;
  EXPECT_THAT(refusal(bad, {.count = 5}), testing::HasSubstr("triangle 3"));
  bad = torus;
  bad.vertices[bad.triangles[2][0]].x() = infinity;
  EXPECT_THAT(refusal(bad, {.count = 5}), testing::HasSubstr("not finite"));
  for (Vector3& x : bad.vertices) x = Vector3::UnitX();
  EXPECT_THAT(refusal(bad, {.count = 5}), testing::HasSubstr("no finite area"));
}

}  // namespace surface_samples_test
}  // namespace hpsdf::physics
