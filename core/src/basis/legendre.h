#pragma once
// Legendre polynomials L_i on [-1, 1] (not normalised) and Gauss quadrature on them.

#include <vector>

namespace hpsdf {

/// values[i] = L_i(t) for i = 0..degree, by the three-term recurrence (paper, eq. 4).
inline void legendreValues(double t, int degree, double* values) {
  values[0] = 1;
  if (degree == 0) return;
  values[1] = t;
  for (int i = 2; i <= degree; ++i) values[i] = ((2 * i - 1) * t * values[i - 1] - (i - 1) * values[i - 2]) / i;
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

/// The rule squeezed into both halves of [-1, 1]: the points that the children of a cell share along an axis.
QuadratureRule splitInHalves(const QuadratureRule& rule);

}  // namespace hpsdf
