#include "hpsdf/verify.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>

#include "hpsdf/build.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"

namespace hpsdf {
namespace verify_test {

double height(const Vector3& x) { return x.z(); }

/// Returns a mesh of the plane z = 0 within the domain [−1, 1]³.
const TriangleMesh& plane() {
  static const TriangleMesh mesh = {{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, "plane"};
  return mesh;
}

/// Makes two cells along x over [−1, 1]³, in each of which f = offset + slope·x.
Field twoPlanes(const std::array<double, 2>& offset, const Vector3& slope) {
  FieldData data;
  data.domain = Box(Vector3(-1, -1, -1), Vector3(1, 1, 1));
  data.grid = {2, 1, 1};
  data.nodes = {node::leaf(1, 0), node::leaf(1, 4)};
  std::vector<double> coefficients;  // of 1, w, v, u; the local coordinate u spans half of the domain
  for (int cell = 0; cell < 2; ++cell) {
    const double center = cell == 0 ? -0.5 : 0.5;
    coefficients.insert(coefficients.end(), {offset[cell] + slope.x() * center, slope.z(), slope.y(), slope.x() / 2});
  }
  data.coefficients = coefficients;
  return Field(std::move(data));
}

Verification verifyAgainstPlane(const Field& field, VerifyOptions options = {.points = 20'000}) {
  const DistanceFunction distance = height;
  return verify(field, {distance, [](const Vector3&, double) { return Vector3(0, 0, 1); }, plane()}, options);
}

TEST(Verify, measuresAConstantError) {
  for (const double offset : {0.01, 0.25}) {
    const Verification found = verifyAgainstPlane(twoPlanes({offset, offset}, {0, 0, 1}));
    for (const SampleFigures* figures : {&found.uniform, &found.nearSurface}) {
      EXPECT_EQ(figures->error.samples, 10'000u);
      EXPECT_NEAR(figures->error.rms, offset, 1e-12);
      EXPECT_NEAR(figures->error.mean, offset, 1e-12);
      EXPECT_NEAR(figures->error.max, offset, 1e-12);
      for (const auto& [percent, error] : figures->error.percentiles) EXPECT_NEAR(error, offset, 1e-12) << percent;
      EXPECT_NEAR(figures->gradient.meanLength, 1, 1e-12);
      EXPECT_NEAR(figures->gradient.maxPairSlope, 1, 0.05);
      EXPECT_NEAR(figures->gradient.maxAngleDegrees, 0, 1e-6);
    }
    EXPECT_EQ(found.uniform.error.percentiles.size(), 4u);
    EXPECT_NEAR(found.near, 0.02, 1e-15);  // the default: a hundredth of the plane's side
  }
}

TEST(Verify, computesPercentilesOfTheErrors) {
  // |f − Φ| = |x| is distributed uniformly between 0 and 1.
  const Verification found = verifyAgainstPlane(twoPlanes({0, 0}, {1, 0, 1}), {.points = 200'000});
  for (const double percent : {50.0, 90.0, 99.0, 99.9})
    EXPECT_NEAR(found.uniform.error.percentiles.at(percent), percent / 100, 0.01);
  EXPECT_NEAR(found.uniform.error.rms, std::sqrt(1.0 / 3), 0.005);
  EXPECT_NEAR(found.uniform.error.mean, 0.5, 0.005);
}

TEST(Verify, findsWrongSignsBetweenTheSurfaceAndTheZeroOfTheField) {
  const Verification found = verifyAgainstPlane(twoPlanes({0.1, 0.1}, {0, 0, 1}), {.points = 40'000});
  EXPECT_NEAR(double(found.uniform.signs.mismatches), 20'000 * 0.05, 150);
  EXPECT_NEAR(found.uniform.signs.farthest, 0.1, 2e-3);
  EXPECT_EQ(found.uniform.signs.defects, 0u);  // wrong signs within ten times the error are no defects
  const Verification strict =
      verifyAgainstPlane(twoPlanes({0.1, 0.1}, {0, 0, 1}), {.points = 40'000, .signBound = 0.05});
  EXPECT_NEAR(double(strict.uniform.signs.defects), 20'000 * 0.025, 150);
  EXPECT_EQ(strict.uniform.signs.mismatches, found.uniform.signs.mismatches);
  EXPECT_EQ(verifyAgainstPlane(twoPlanes({0, 0}, {0, 0, 1})).uniform.signs.mismatches, 0u);
}

TEST(Verify, comparesGradientsByAngleAndLength) {
  const Verification found = verifyAgainstPlane(twoPlanes({0, 0}, {0.5, 0, 1}));
  const double length = std::sqrt(1.25), angle = std::atan(0.5) * 180 / M_PI;
  EXPECT_NEAR(found.uniform.gradient.meanLength, length, 1e-12);
  EXPECT_NEAR(found.uniform.gradient.maxLength, length, 1e-12);
  EXPECT_NEAR(found.uniform.gradient.lengthErrorRms, length - 1, 1e-12);
  EXPECT_EQ(found.uniform.gradient.angles, 10'000u);
  for (const double figure : {found.uniform.gradient.meanAngleDegrees, found.uniform.gradient.angle99Degrees,
                              found.uniform.gradient.maxAngleDegrees})
    EXPECT_NEAR(figure, angle, 1e-9);
}

TEST(Verify, listsTheWorstPointOfEachCellWorstFirst) {
  const Verification found = verifyAgainstPlane(twoPlanes({0.3, 0.1}, {0, 0, 1}));
  ASSERT_EQ(found.worst.size(), 2u);  // one point for each of the two cells
  EXPECT_EQ(found.worst[0].cell, 0u);
  EXPECT_LT(found.worst[0].point.x(), 0);
  EXPECT_NEAR(found.worst[0].error(), 0.3, 1e-12);
  EXPECT_EQ(found.worst[0].exact, found.worst[0].point.z());
  EXPECT_EQ(found.worst[0].degree, 1);
  EXPECT_EQ(found.worst[0].depth, 0);
  EXPECT_NEAR(found.worst[1].error(), 0.1, 1e-12);
  EXPECT_GT(found.worst[1].point.x(), 0);
}

TEST(Verify, measuresJumpsAsSlopesBetweenSamples) {
  const Verification found = verifyAgainstPlane(twoPlanes({5, 0}, {0, 0, 1}));
  EXPECT_NEAR(found.uniform.gradient.maxLength, 1, 1e-12);
  EXPECT_GT(found.uniform.gradient.maxPairSlope, 3);
}

TEST(Verify, figuresDoNotDependOnTheThreads) {
  const TriangleMesh mesh = shapes::mesh("torus,segments=64,sides=32");
  const ExactDistance exact(mesh);
  const Field field = build(exact, domainAround(mesh), {.targetError = 1e-3});
  const DistanceFunction distance = exact;
  const VerifiedSurface surface{distance,
                                [&](const Vector3& x, double signedDistance) {
                                  return Vector3((x - exact.closestPoint(x).point) / signedDistance);
                                },
                                mesh};
  const auto with = [&](int threads, std::uint64_t seed) {
    return verify(field, surface, {.points = 30'001, .seed = seed, .worst = 5, .threads = threads});
  };
  const Verification one = with(1, 7), three = with(3, 7), other = with(3, 8);
  EXPECT_EQ(one.uniform.error.samples, 15'001u);
  const auto figures = [](const Verification& v) {
    std::vector<double> list;
    for (const SampleFigures* f : {&v.uniform, &v.nearSurface}) {
      list.insert(list.end(), {f->error.rms, f->error.mean, f->error.max, f->error.percentiles.at(99.9),
                               double(f->signs.mismatches), f->signs.farthest, f->gradient.meanLength,
                               f->gradient.lengthErrorRms, f->gradient.maxLength, f->gradient.meanAngleDegrees,
                               f->gradient.angle99Degrees, f->gradient.maxPairSlope});
    }
    for (const WorstPoint& at : v.worst) list.insert(list.end(), {at.point.x(), at.point.y(), at.value, at.exact});
    return list;
  };
  EXPECT_EQ(figures(one), figures(three));
  EXPECT_NE(figures(one), figures(other));
  EXPECT_EQ(one.worst.size(), 5u);
  // Gradients at points near the surface follow its normal.
  EXPECT_LT(one.nearSurface.gradient.meanAngleDegrees, 10);
}

TEST(Verify, drawsUniformSamplesInTheDomainAndInTheBand) {
  const Box domain(Vector3(-1, -2, -1), Vector3(1, 2, 3));
  const ExactSamples samples = sampleUniform(height, domain, 0, {.count = 80'000});
  ASSERT_EQ(samples.points.size(), 80'000u);
  std::array<int, 8> octants{};
  double distance = 0;
  for (std::size_t n = 0; n < samples.points.size(); ++n) {
    const Vector3& x = samples.points[n];
    ASSERT_TRUE(domain.contains(x));
    ASSERT_EQ(samples.distances[n], x.z());
    const Vector3 from = x - domain.center();
    ++octants[(from.x() > 0) + 2 * (from.y() > 0) + 4 * (from.z() > 0)];
    if (n > 0) distance += (x - samples.points[n - 1]).norm();
  }
  for (const int count : octants) EXPECT_NEAR(count, 10'000, 400);
  EXPECT_LT(distance / 80'000, 0.15);  // in random order, points would be about 2 apart

  const ExactSamples band = sampleUniform(height, domain, 0.05, {.count = 20'000});
  ASSERT_EQ(band.points.size(), 20'000u);
  int inner = 0, right = 0;
  for (std::size_t n = 0; n < band.points.size(); ++n) {
    ASSERT_LE(std::abs(band.distances[n]), 0.05);
    inner += std::abs(band.distances[n]) < 0.025;
    right += band.points[n].x() > 0;
  }
  EXPECT_NEAR(inner, 10'000, 400);
  EXPECT_NEAR(right, 10'000, 400);
}

TEST(Verify, drawsNearSamplesCloseToTheSurfaceAndInTheDomain) {
  const Box half(Vector3(-1, -1, -1), Vector3(0, 1, 1));  // the half of the domain with x < 0
  const ExactSamples samples = sampleNear(height, plane(), half, 0.1, {.count = 20'000});
  ASSERT_EQ(samples.points.size(), 20'000u);
  int lower = 0, front = 0;
  double greatest = 0;
  for (std::size_t n = 0; n < samples.points.size(); ++n) {
    ASSERT_TRUE(half.contains(samples.points[n]));
    greatest = std::max(greatest, std::abs(samples.distances[n]));
    lower += samples.distances[n] < 0;
    front += samples.points[n].y() < 0;
  }
  EXPECT_LE(greatest, 0.1);
  EXPECT_GT(greatest, 0.09);
  EXPECT_NEAR(lower, 10'000, 400);
  EXPECT_NEAR(front, 10'000, 400);
}

std::string errorOf(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Verify, refusesImpossibleSamples) {
  const Box domain(Vector3(-1, -1, 1), Vector3(1, 1, 2));
  EXPECT_NE(errorOf([&] { sampleUniform(height, domain, 0.05); }).find("within the band"), std::string::npos);
  EXPECT_NE(errorOf([&] { sampleNear(height, plane(), domain, 0.1, {.count = 100}); }).find("misses the surface"),
            std::string::npos);
  EXPECT_NE(errorOf([&] { sampleNear(height, TriangleMesh{}, domain, 0.1); }).find("no area"), std::string::npos);
  const auto nan = [](const Vector3&) { return std::numeric_limits<double>::quiet_NaN(); };
  EXPECT_NE(errorOf([&] { sampleUniform(nan, domain); }).find("not finite at"), std::string::npos);
  EXPECT_NE(errorOf([&] {
              verifyAgainstPlane(twoPlanes({0, 0}, {0, 0, 1}), {.points = 1});
            }).find("too few points"),
            std::string::npos);
  EXPECT_NE(errorOf([&] {
              verifyAgainstPlane(twoPlanes({0, 0}, {0, 0, 1}), {.points = 10, .near = -1});
            }).find("below 0"),
            std::string::npos);
}

/// The error must appear after few candidates, not after a thousand candidates for each wanted point.
TEST(Verify, refusesImpossibleSamplesSoon) {
  std::atomic<std::size_t> calls = 0;
  const auto counting = [&](const Vector3& x) {
    ++calls;
    return x.z();
  };
  const Box domain(Vector3(-1, -1, -1), Vector3(1, 1, 1));
  EXPECT_NE(errorOf([&] { sampleUniform(counting, domain, 1e-8, {.count = 100'000}); }).find("within the band"),
            std::string::npos);
  EXPECT_LT(calls, 500'000u);
}

TEST(Verify, canBeCancelled) {
  const Progress progress{.report = {}, .cancelled = [] { return true; }};
  EXPECT_THROW(sampleUniform(height, Box(Vector3(-1, -1, -1), Vector3(1, 1, 1)), 0, {}, progress), Cancelled);
}

TEST(Verify, measureErrorAgreesWithVerify) {
  const Field field = twoPlanes({0.3, 0.1}, {0, 0, 1});
  const ExactSamples samples = sampleUniform(height, field.domain(), 0, {.count = 10'000});
  const ErrorFigures figures = measureError(field, samples);
  EXPECT_EQ(figures.rms, verifyAgainstPlane(field).uniform.error.rms);
  EXPECT_NEAR(figures.rms, std::sqrt((0.09 + 0.01) / 2), 2e-3);
  EXPECT_EQ(measureError(field, {}).samples, 0u);
}

}  // namespace verify_test
}  // namespace hpsdf
