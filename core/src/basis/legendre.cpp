#include "basis/legendre.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace hpsdf::basis {

QuadratureRule gaussLegendre(int n) {
  QuadratureRule rule;
  rule.points.resize(n);
  rule.weights.resize(n);
  std::vector<double> values(n + 1);
  std::vector<double> derivatives(n + 1);
  for (int i = 0; i < (n + 1) / 2; ++i) {
    // Find the i-th largest root t of L_n by Newton's method. From Tricomi's estimate of the root, the method
    // reaches rounding precision in a few steps.
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
