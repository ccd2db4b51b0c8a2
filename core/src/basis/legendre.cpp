#include "basis/legendre.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace hpsdf::basis {

LegendreRows legendreOnPart(double shift, double scale, int degree) {
  LegendreRows row;
  row[0][0] = 1;
  for (int i = 0; i < degree; ++i) {
    std::array<double, kMaxDegree + 2> product;  // (shift + scale·t) · L_i, by the recurrence of t·L_a
    std::fill_n(product.begin(), i + 2, 0.0);
    for (int a = 0; a <= i; ++a) {
      product[a] += shift * row[i][a];
      product[a + 1] += scale * row[i][a] * (a + 1) / (2 * a + 1);
      if (a > 0) product[a - 1] += scale * row[i][a] * a / (2 * a + 1);
    }
    for (int a = 0; a <= i + 1; ++a)
      row[i + 1][a] = ((2 * i + 1) * product[a] - (a < i ? i * row[i - 1][a] : 0)) / (i + 1);
  }
  return row;
}

QuadratureRule gaussLegendre(int n) {
  QuadratureRule rule;
  rule.points.resize(n);
  rule.weights.resize(n);
  std::vector<double> values(n + 1);
  std::vector<double> derivatives(n + 1);
  for (int i = 0; i < (n + 1) / 2; ++i) {
    // Newton's method from Tricomi's estimate of the i-th largest root reaches rounding in a few steps.
    double t = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5));
    for (int step = 0; step < 50; ++step) {
      legendreValuesAndDerivatives(t, n, values.data(), derivatives.data());
      const double change = values[n] / derivatives[n];
      t -= change;
      if (std::abs(change) < 1e-16) break;
    }
    if (2 * i + 1 == n) t = 0;
    legendreValuesAndDerivatives(t, n, values.data(), derivatives.data());
    const double weight = 2 / ((1 - t * t) * derivatives[n] * derivatives[n]);
    rule.points[i] = -t;
    rule.points[n - 1 - i] = t;
    rule.weights[i] = rule.weights[n - 1 - i] = weight;
  }
  return rule;
}

}  // namespace hpsdf::basis
