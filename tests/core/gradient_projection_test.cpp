// Tests projections from values and gradients, and constructions that use them.
#include "basis/gradient_projection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "field/query/evaluate.h"
#include "hpsdf/build.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"
#include "hpsdf/verify.h"

namespace hpsdf {
namespace gradient_projection_test {

struct Sample {
  double value;
  Vector3 gradient;
};
using Function = std::function<Sample(const Vector3&)>;

std::vector<double> sampled(const basis::Projection& projection, const Function& f) {
  std::vector<double> samples;
  for (const Vector3& x : projection.points()) {
    const Sample sample = f(x);
    samples.push_back(sample.value);
    if (projection.takesGradients()) samples.insert(samples.end(), sample.gradient.begin(), sample.gradient.end());
  }
  return samples;
}

std::vector<double> randomCoefficients(int degree) {
  std::mt19937_64 random(3);
  std::vector<double> c(coefficientCount(degree));
  for (double& value : c) value = std::uniform_real_distribution<double>(-1, 1)(random);
  return c;
}

TEST(GradientProjection, existsForDegreesThreeToSix) {
  const std::map<int, std::size_t> points = {{3, 14}, {4, 34}, {5, 34}, {6, 58}};
  for (int degree = 1; degree <= kMaxDegree; ++degree) {
    const auto projection = basis::gradientProjection(degree);
    ASSERT_EQ(projection != nullptr, points.contains(degree)) << degree;
    if (!projection) continue;
    EXPECT_EQ(projection->degree(), degree);
    EXPECT_EQ(projection->points().size(), points.at(degree));
    for (const Vector3& x : projection->points()) EXPECT_LT(x.cwiseAbs().maxCoeff(), 1);
  }
}

TEST(GradientProjection, reproducesEveryPolynomialOfOneDegreeLess) {
  for (int degree = 3; degree <= 6; ++degree) {
    const auto projection = basis::gradientProjection(degree);
    const std::vector<double> expected = basis::appendTopDegree(
        randomCoefficients(degree - 1), std::vector<double>(coefficientCount(degree), 0.0), degree);
    const std::vector<double> samples = sampled(*projection, [&](const Vector3& x) {
      const auto found = query::evaluateWithGradient(expected.data(), degree, {x.x(), x.y(), x.z()});
      return Sample{found.value, {found.gradient[0], found.gradient[1], found.gradient[2]}};
    });
    const std::vector<double> found = (*projection)(samples);
    double square = 0;
    basis::forEachCoefficient(degree, [&](int i, int j, int k, int index) {
      EXPECT_NEAR(found[index], expected[index], 1e-12) << degree << ": " << i << j << k;
      square += expected[index] * expected[index] * basis::squaredNorm(i, j, k);
    });
    EXPECT_NEAR(projection->meanSquare(samples, found), square, 1e-12);  // no error is left
  }
}

/// |n·x − offset|, whose kink crosses the cell.
Function kink(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const Vector3 n = Vector3(normal(random), normal(random), normal(random)).normalized();
  const double offset = std::uniform_real_distribution<double>(-1.7, 1.7)(random);
  return [n, offset](const Vector3& x) {
    const double height = n.dot(x) - offset;
    return height < 0 ? Sample{-height, -n} : Sample{height, n};
  };
}

struct Errors {
  double measured = 0, estimated = 0;  ///< mean squared errors of the fit of degree `degree`
};

/// Returns the sums of the errors of the fits of one degree to many kinks, whose samples are projected onto one more.
Errors errorsOfKinks(const basis::Projection& projection, int degree) {
  const auto exact = basis::productProjection(basis::gaussLegendre(16), degree);
  std::mt19937_64 random(1);
  Errors sum;
  for (int n = 0; n < 1000; ++n) {
    const Function f = kink(random);
    const std::vector<double> samples = sampled(projection, f), dense = sampled(*exact, f);
    const std::vector<double> found = projection(samples);
    const std::vector<double> fit = basis::truncated(found, projection.degree(), degree), best = (*exact)(dense);
    double square = 0, cross = 0;
    basis::forEachCoefficient(degree, [&](int i, int j, int k, int index) {
      square += fit[index] * fit[index] * basis::squaredNorm(i, j, k);
      cross += fit[index] * best[index] * basis::squaredNorm(i, j, k);
    });
    sum.measured += exact->meanSquare(dense, best) - 2 * cross + square;
    sum.estimated += projection.meanSquare(samples, found) - square;
  }
  return sum;
}

TEST(GradientProjection, fitsKinksAsWellAsFourTimesAsManyValues) {
  for (const auto& [degree, order, most] : {std::tuple{2, 7, 1.06}, std::tuple{3, 9, 1.0}, std::tuple{4, 11, 1.07}}) {
    const auto gradients = basis::gradientProjection(degree + 1);
    const auto values = basis::matrixProjection(*basis::compactCubature(order), degree + 1);
    const Errors byGradients = errorsOfKinks(*gradients, degree);
    EXPECT_LT(byGradients.measured, most * errorsOfKinks(*values, degree).measured) << degree;
    EXPECT_LT(gradients->points().size(), 0.6 * double(values->points().size()));
    EXPECT_NEAR(byGradients.estimated / byGradients.measured, 0.85, 0.1) << degree;
  }
}

/// A distance whose gradient may be hidden or spoilt.
struct Offered {
  const ExactDistance& exact;
  bool hides = false, spoils = false;

  Source source() const { return exact.source(); }
  const TriangleSearch& triangleSearch() const { return exact.triangleSearch(); }
  void operator()(std::span<const Vector3> points, std::span<double> out) const { exact(points, out); }
  bool hasGradients() const { return !hides; }
  void withGradients(std::span<const Vector3> points, std::span<double> out, std::span<Vector3> gradients) const {
    exact.withGradients(points, out, gradients);
    if (spoils) gradients[gradients.size() / 2].y() = std::nan("");
  }
};

struct Built {
  std::uint64_t evaluations;
  std::size_t bytes;
  ErrorFigures near, uniform;
};

Built built(const DistanceFunction& distance, const TriangleMesh& mesh, const BuildOptions& options) {
  const Box domain = domainAround(mesh);
  const Field field = build(distance, domain, options);
  return {field.metadata().exactEvaluations, field.bytes(),
          measureError(field, sampleNear(distance, mesh, domain, 0.02, {.count = 50'000})),
          measureError(field, sampleUniform(distance, domain, 0, {.count = 50'000}))};
}

TEST(GradientProjection, halvesTheDistancesOfAConstruction) {
  const TriangleMesh mesh = normalized(shapes::mesh("torus"));
  const ExactDistance exact(mesh);
  BuildOptions options{.targetError = 1e-6, .strategy = Strategy::hp};
  const Built byGradients = built(exact, mesh, options);
  options.cubature = CubatureKind::compact;
  const Built byValues = built(exact, mesh, options);
  EXPECT_LT(byGradients.evaluations, 0.5 * double(byValues.evaluations));
  EXPECT_LT(byGradients.bytes, 1.03 * double(byValues.bytes));
  EXPECT_LT(byGradients.near.rms, 1.03 * byValues.near.rms);
  EXPECT_LT(byGradients.uniform.rms, 1.03 * byValues.uniform.rms);
}

TEST(GradientProjection, isNotUsedWithoutGradients) {
  const TriangleMesh mesh = normalized(shapes::mesh("torus"));
  const ExactDistance exact(mesh);
  const BuildOptions options{.targetError = 1e-5};
  BuildOptions compact = options, embedded = options;
  compact.cubature = CubatureKind::compact;
  embedded.estimator = Estimator::embedded;
  BuildOptions both = compact;
  both.estimator = Estimator::embedded;
  const Box domain = domainAround(mesh);
  EXPECT_TRUE(build(exact, domain, embedded).data().nodes == build(exact, domain, both).data().nodes);
  const Field byValues = build(exact, domain, compact);
  EXPECT_TRUE(build(Offered{exact, true}, domain, options).data().nodes == byValues.data().nodes);
  EXPECT_FALSE(build(Offered{exact}, domain, options).data().nodes == byValues.data().nodes);
}

TEST(GradientProjection, gradientsThatAreNotFiniteAreRefused) {
  const TriangleMesh mesh = shapes::mesh("torus");
  const ExactDistance exact(mesh);
  try {
    build(Offered{exact, false, true}, domainAround(mesh));
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("the gradient of the signed distance is not finite at ("),
              std::string::npos)
        << error.what();
  }
}

}  // namespace gradient_projection_test
}  // namespace hpsdf
