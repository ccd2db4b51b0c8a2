#pragma once
// Legendre polynomials L_i on [-1, 1], with L_i(1) = 1, and Gauss quadrature.

#include <array>
#include <type_traits>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf::basis {

/// Number of tabulated ratios i/(i+1) of the three-term recurrence: one for each degree i from 0 to 255. No quadrature
/// rule needs Legendre polynomials of a higher degree.
constexpr int kMostLegendre = 256;
constexpr auto kLegendreRatio = [] {
  std::array<double, kMostLegendre> ratio{};
  for (int i = 0; i < kMostLegendre; ++i) ratio[i] = double(i) / (i + 1);
  return ratio;
}();

#include "basis/legendre-inl.h"

/// Computes second[i] = L_i''(t) for i = 0..degree from the first derivatives, by the derivative of their recurrence.
inline void legendreSecondDerivatives(int degree, const double* derivatives, double* second) {
  for (int i = 0; i <= degree; ++i) second[i] = i < 2 ? 0 : second[i - 2] + (2 * i - 1) * derivatives[i - 1];
}

/// Points and weights of a quadrature rule on [-1, 1].
struct QuadratureRule {
  std::vector<double> points;
  std::vector<double> weights;
};

/// Returns the n-point Gauss-Legendre rule, which is exact for polynomials up to degree 2n-1. The points ascend
/// and are exactly symmetric about 0.
QuadratureRule gaussLegendre(int n);

}  // namespace hpsdf::basis
