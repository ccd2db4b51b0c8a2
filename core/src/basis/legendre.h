#pragma once
// Legendre polynomials L_i on [-1, 1], with L_i(1) = 1, and Gauss quadrature.

#include <array>
#include <type_traits>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf::basis {

/// The ratios i/(i+1) of the recurrence, up to the highest degree that a quadrature rule needs.
constexpr int kMostLegendre = 256;
constexpr auto kLegendreRatio = [] {
  std::array<double, kMostLegendre> ratio{};
  for (int i = 0; i < kMostLegendre; ++i) ratio[i] = double(i) / (i + 1);
  return ratio;
}();

#include "basis/legendre-inl.h"

/// Rows of L_i(shift + scale·t) = Σ_a row[i][a] L_a(t), a ≤ i. Elements beyond the degree are not set.
using LegendreRows = std::array<std::array<double, kMaxDegree + 2>, kMaxDegree + 2>;
LegendreRows legendreOnPart(double shift, double scale, int degree);

/// Points and weights of a quadrature rule on [-1, 1].
struct QuadratureRule {
  std::vector<double> points;
  std::vector<double> weights;
};

/// The n-point Gauss-Legendre rule, exact for polynomials up to degree 2n-1. Points ascend and are exactly symmetric.
QuadratureRule gaussLegendre(int n);

}  // namespace hpsdf::basis
