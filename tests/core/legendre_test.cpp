#include "basis/legendre.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hpsdf {
namespace legendre_test {

TEST(Legendre, valuesMatchTheStandardLibrary) {
  double values[31];
  for (const double t : {-1.0, -0.73, -0.2, 0.0, 0.31, 0.999, 1.0}) {
    basis::legendreValues(t, 30, values);
    for (unsigned i = 0; i <= 30; ++i) EXPECT_NEAR(values[i], std::legendre(i, t), 1e-13) << i << " at " << t;
  }
}

TEST(Legendre, derivativesMatchCentralDifferencesAndTheEnds) {
  double values[31], derivatives[31], above[31], below[31];
  const double step = 1e-6;
  for (const double t : {-0.9, -0.35, 0.0, 0.2, 0.8}) {
    basis::legendreValuesAndDerivatives(t, 30, values, derivatives);
    basis::legendreValues(t + step, 30, above);
    basis::legendreValues(t - step, 30, below);
    for (int i = 0; i <= 30; ++i) EXPECT_NEAR(derivatives[i], (above[i] - below[i]) / (2 * step), 1e-6) << i;
  }
  basis::legendreValuesAndDerivatives(1, 30, values, derivatives);
  for (int i = 0; i <= 30; ++i) EXPECT_DOUBLE_EQ(derivatives[i], i * (i + 1) / 2.0);  // L_i'(1)
}

TEST(Legendre, secondDerivativesSatisfyTheDifferentialEquation) {
  double values[31], derivatives[31], second[31];
  for (const double t : {-1.0, -0.9, -0.35, 0.0, 0.2, 0.8, 1.0}) {
    basis::legendreValuesAndDerivatives(t, 30, values, derivatives);
    basis::legendreSecondDerivatives(30, derivatives, second);
    for (int i = 0; i <= 30; ++i)  // (1 − t²) L'' = 2t L' − i(i+1) L
      EXPECT_NEAR((1 - t * t) * second[i], 2 * t * derivatives[i] - i * (i + 1) * values[i], 1e-11 * (1 + i * i)) << i;
  }
  for (int i = 0; i <= 30; ++i) EXPECT_DOUBLE_EQ(second[i], (i - 1.0) * i * (i + 1) * (i + 2) / 8);  // L_i''(1)
  basis::legendreSecondDerivatives(0, derivatives, second);
  EXPECT_EQ(second[0], 0);
}

TEST(GaussLegendre, integratesUpToItsDegreeAndNoFurther) {
  for (int n = 1; n <= 121; ++n) {
    const basis::QuadratureRule rule = basis::gaussLegendre(n);
    ASSERT_EQ(rule.points.size(), std::size_t(n));
    const auto integral = [&](int power) {
      double sum = 0;
      for (int q = 0; q < n; ++q) sum += rule.weights[q] * std::pow(rule.points[q], power);
      return sum;
    };
    EXPECT_NEAR(integral(0), 2, 1e-13) << n;
    const int highest = 2 * n - 2;  // the highest even power that the rule integrates exactly
    EXPECT_NEAR(integral(highest), 2.0 / (highest + 1), 1e-13) << n;
    if (n <= 8) {
      EXPECT_GT(std::abs(integral(2 * n) - 2.0 / (2 * n + 1)), 1e-9) << n;
    }
    for (int q = 0; q < n; ++q) EXPECT_EQ(rule.points[q], -rule.points[n - 1 - q]);
  }
}

}  // namespace legendre_test
}  // namespace hpsdf
