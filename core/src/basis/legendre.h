#pragma once
// Legendre polynomials L_i on [-1, 1] (not normalised) and Gauss quadrature on them.

#include <array>
#include <vector>

namespace hpsdf {

/// i/(i+1), for the recurrence up to the highest degree that a quadrature of ours needs.
constexpr int kMostLegendre = 256;
constexpr auto kLegendreRatio = [] {
  std::array<double, kMostLegendre> ratio{};
  for (int i = 0; i < kMostLegendre; ++i) ratio[i] = double(i) / (i + 1);
  return ratio;
}();

/// values[i] = L_i(t) for i = 0..degree, by the three-term recurrence (paper, eq. 4), here as
/// L_{i+1} = t L_i + (t L_i - L_{i-1}) i/(i+1): a division a degree would take longer than all the rest.
inline void legendreValues(double t, int degree, double* values) {
  values[0] = 1;
  if (degree == 0) return;
  values[1] = t;
  for (int i = 1; i < degree; ++i) {
    const double product = t * values[i];
    values[i + 1] = product + (product - values[i - 1]) * kLegendreRatio[i];
  }
}

/// Also derivatives[i] = L_i'(t), by L_i' = L_{i-2}' + (2i-1) L_{i-1}, which holds at the ends of the interval too.
inline void legendreValuesAndDerivatives(double t, int degree, double* values, double* derivatives) {
  legendreValues(t, degree, values);
  derivatives[0] = 0;
  if (degree == 0) return;
  derivatives[1] = 1;
  for (int i = 2; i <= degree; ++i) derivatives[i] = derivatives[i - 2] + (2 * i - 1) * values[i - 1];
}

/// Points and weights of a quadrature rule on [-1, 1].
struct QuadratureRule {
  std::vector<double> points;
  std::vector<double> weights;
};

/// The n-point Gauss-Legendre rule: exact for polynomials up to degree 2n-1. Points ascend and are exactly symmetric.
QuadratureRule gaussLegendre(int n);

}  // namespace hpsdf
