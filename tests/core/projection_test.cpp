#include "basis/projection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "field/evaluate.h"

namespace hpsdf {
namespace {

std::vector<double> randomCoefficients(int degree, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> c(coefficientCount(degree));
  for (double& value : c) value = uniform(random);
  return c;
}

std::vector<double> sampled(const std::vector<double>& c, int degree, const QuadratureRule& rule) {
  std::vector<double> samples;
  for (const double x : rule.points)
    for (const double y : rule.points)
      for (const double z : rule.points) samples.push_back(evaluate(c.data(), degree, {x, y, z}));
  return samples;
}

TEST(Projection, ReproducesEveryPolynomialOfItsDegree) {
  for (const int degree : {1, 2, 3, 5, 9, 17, 30}) {
    const auto c = randomCoefficients(degree, 7);
    for (const bool split : {false, true}) {
      const QuadratureRule rule = split ? splitInHalves(gaussLegendre(degree + 1)) : gaussLegendre(degree + 1);
      const auto fitted = Projection(rule, degree)(sampled(c, degree, rule));
      ASSERT_EQ(fitted.size(), c.size());
      for (std::size_t i = 0; i < c.size(); ++i) ASSERT_NEAR(fitted[i], c[i], 1e-11) << "degree " << degree;
    }
  }
}

TEST(Projection, LowerDegreesDoNotFeelHigherOnes) {
  const auto c = randomCoefficients(5, 3);
  const QuadratureRule rule = gaussLegendre(6);
  const auto samples = sampled(c, 5, rule);
  const auto fitted = Projection(rule, 3)(samples);
  forEachCoefficient(3, [&](int i, int j, int k, int index) {
    forEachCoefficient(5, [&](int a, int b, int d, int other) {
      if (a == i && b == j && d == k) {
        EXPECT_NEAR(fitted[index], c[other], 1e-13);
      }
    });
  });
}

TEST(Projection, MeanSquareIsParseval) {
  const auto c = randomCoefficients(4, 11);
  const QuadratureRule rule = gaussLegendre(5);
  double parseval = 0;
  forEachCoefficient(4,
                     [&](int i, int j, int k, int index) { parseval += c[index] * c[index] * squaredNorm(i, j, k); });
  EXPECT_NEAR(Projection(rule, 4).meanSquare(sampled(c, 4, rule)), parseval, 1e-13);
}

TEST(Projection, TopDegreeErrorIsTheNormOfTheLastShell) {
  const auto c = randomCoefficients(6, 5);
  double shell = 0;
  forEachCoefficient(6, [&](int i, int j, int k, int index) {
    if (i + j + k == 6) shell += c[index] * c[index] * squaredNorm(i, j, k);
  });
  EXPECT_NEAR(topDegreeError(c.data(), 6, 2.5), 2.5 * shell, 1e-14);
}

TEST(Projection, AppendingKeepsTheLowerCoefficients) {
  const auto lower = randomCoefficients(3, 1);
  const auto raised = randomCoefficients(4, 2);
  const auto both = appendTopDegree(lower, raised, 4);
  std::size_t next = 0;
  forEachCoefficient(4, [&](int i, int j, int k, int index) {
    EXPECT_EQ(both[index], i + j + k == 4 ? raised[index] : lower[next++]);
  });
}

TEST(Evaluate, GradientMatchesCentralDifferences) {
  for (const int degree : {1, 2, 4, 12}) {
    const auto c = randomCoefficients(degree, 9);
    const std::array<double, 3> at = {0.3, -0.55, 0.81};
    const auto result = evaluateWithGradient(c.data(), degree, at);
    EXPECT_DOUBLE_EQ(result.value, evaluate(c.data(), degree, at));
    for (int axis = 0; axis < 3; ++axis) {
      auto above = at, below = at;
      above[axis] += 1e-6;
      below[axis] -= 1e-6;
      const double difference = (evaluate(c.data(), degree, above) - evaluate(c.data(), degree, below)) / 2e-6;
      EXPECT_NEAR(result.gradient[axis], difference, 1e-6 * (1 + std::abs(difference)));
    }
  }
}

}  // namespace
}  // namespace hpsdf
