#include "basis/projection.h"

#include <cassert>
#include <cstddef>

namespace hpsdf {

Projection::Projection(const QuadratureRule& rule, int degree)
    : degree_(degree), points_(static_cast<int>(rule.points.size())), weights_(rule.weights) {
  rows_.resize(std::size_t(degree + 1) * points_);
  std::vector<double> values(degree + 1);
  for (int q = 0; q < points_; ++q) {
    legendreValues(rule.points[q], degree, values.data());
    for (int i = 0; i <= degree; ++i) rows_[std::size_t(i) * points_ + q] = (2 * i + 1) / 2.0 * weights_[q] * values[i];
  }
}

std::vector<double> Projection::operator()(std::span<const double> samples) const {
  const int n = points_;
  const int count = degree_ + 1;
  assert(samples.size() == std::size_t(n) * n * n);

  // z: alongZ[a][b][k]
  std::vector<double> alongZ(std::size_t(n) * n * count);
  for (int line = 0; line < n * n; ++line) {
    const double* in = &samples[std::size_t(line) * n];
    double* out = &alongZ[std::size_t(line) * count];
    for (int k = 0; k < count; ++k) {
      const double* row = &rows_[std::size_t(k) * n];
      double sum = 0;
      for (int c = 0; c < n; ++c) sum += row[c] * in[c];
      out[k] = sum;
    }
  }

  // y: alongY[a][j][k], j+k ≤ p
  std::vector<double> alongY(std::size_t(n) * count * count, 0.0);
  for (int a = 0; a < n; ++a) {
    for (int j = 0; j < count; ++j) {
      double* out = &alongY[(std::size_t(a) * count + j) * count];
      for (int b = 0; b < n; ++b) {
        const double factor = rows_[std::size_t(j) * n + b];
        const double* in = &alongZ[(std::size_t(a) * n + b) * count];
        for (int k = 0; k < count - j; ++k) out[k] += factor * in[k];
      }
    }
  }

  // x
  std::vector<double> coefficients(coefficientCount(degree_), 0.0);
  double* out = coefficients.data();
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count - i; ++j) {
      const int length = count - i - j;
      for (int a = 0; a < n; ++a) {
        const double factor = rows_[std::size_t(i) * n + a];
        const double* in = &alongY[(std::size_t(a) * count + j) * count];
        for (int k = 0; k < length; ++k) out[k] += factor * in[k];
      }
      out += length;
    }
  }
  return coefficients;
}

double Projection::meanSquare(std::span<const double> samples) const {
  const int n = points_;
  double total = 0;
  for (int a = 0; a < n; ++a) {
    for (int b = 0; b < n; ++b) {
      double line = 0;
      for (int c = 0; c < n; ++c) {
        const double value = samples[(std::size_t(a) * n + b) * n + c];
        line += weights_[c] * value * value;
      }
      total += weights_[a] * weights_[b] * line;
    }
  }
  return total / 8;
}

std::vector<double> appendTopDegree(std::span<const double> lower, std::span<const double> raised, int raisedDegree) {
  std::vector<double> result(raised.begin(), raised.end());
  std::size_t next = 0;
  forEachCoefficient(raisedDegree, [&](int i, int j, int k, int index) {
    if (i + j + k < raisedDegree) result[index] = lower[next++];
  });
  assert(next == lower.size());
  return result;
}

}  // namespace hpsdf
