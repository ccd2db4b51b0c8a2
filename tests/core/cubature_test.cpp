#include "basis/cubature.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace hpsdf {
namespace cubature_test {

double integral(const basis::Cubature& rule, int i, int j, int k) {
  double sum = 0;
  for (std::size_t q = 0; q < rule.points.size(); ++q)
    sum += rule.weights[q] * std::pow(rule.points[q].x(), i) * std::pow(rule.points[q].y(), j) *
           std::pow(rule.points[q].z(), k);
  return sum;
}

/// Returns ∫ x^i dx over [-1, 1].
double exact(int i) { return i % 2 == 0 ? 2.0 / (i + 1) : 0; }

TEST(CompactCubature, integratesUpToItsOrderAndNoFurther) {
  const std::map<int, std::size_t> points = {{5, 14}, {7, 34}, {9, 58}, {11, 90}, {13, 148}};
  for (const auto& [order, count] : points) {
    const auto rule = basis::compactCubature(order);
    ASSERT_TRUE(rule);
    EXPECT_EQ(rule->points.size(), count);
    EXPECT_EQ(basis::compactCubature(order - 1)->points, rule->points);
    for (int i = 0; i <= order; ++i)
      for (int j = 0; i + j <= order; ++j)
        for (int k = 0; i + j + k <= order; ++k)
          ASSERT_NEAR(integral(*rule, i, j, k), exact(i) * exact(j) * exact(k), 1e-14) << order << ": " << i << j << k;
    EXPECT_GT(std::abs(integral(*rule, order + 1, 0, 0) - 4 * exact(order + 1)), 1e-5) << order;
    for (std::size_t q = 0; q < count; ++q) {
      EXPECT_GT(rule->weights[q], 0);
      EXPECT_LT(rule->points[q].cwiseAbs().maxCoeff(), 1);
    }
  }
  EXPECT_FALSE(basis::compactCubature(14));
}

}  // namespace cubature_test
}  // namespace hpsdf
