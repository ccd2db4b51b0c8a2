#pragma once
// L2 projection of samples onto the polynomials of total degree p of a cell: a tensor contraction one axis after
// another.
//
// Samples stand at the tensor product of an axis rule of n points, z fastest: sample (a, b, c) at (a·n + b)·n + c.
// Coefficients stand in the order of FieldData: lexicographic in (i, j, k), i+j+k ≤ p, k fastest, of plain L_i L_j L_k.

#include <span>
#include <vector>

#include "basis/legendre.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// Calls f(i, j, k, index) for every coefficient of total degree ≤ p, in their order of storage.
template <typename F>
void forEachCoefficient(int degree, F&& f) {
  int index = 0;
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; j <= degree - i; ++j)
      for (int k = 0; k <= degree - i - j; ++k) f(i, j, k, index++);
}

/// ∫ (L_i L_j L_k)² over the cell, divided by its volume.
inline double squaredNorm(int i, int j, int k) { return 1.0 / ((2 * i + 1) * (2 * j + 1) * (2 * k + 1)); }

/// Squared L2 norm of the part of exactly total degree p, over a cell of the given volume (paper, eq. 6).
template <typename T>
double topDegreeError(const T* coefficients, int degree, double volume) {
  double sum = 0;
  int end = 0;  // one past the row (i, j): its last entry has total degree p
  for (int i = 0; i <= degree; ++i) {
    for (int j = 0; j <= degree - i; ++j) {
      const int k = degree - i - j;
      end += k + 1;
      const double c = coefficients[end - 1];
      sum += c * c * squaredNorm(i, j, k);
    }
  }
  return sum * volume;
}

/// Projects from the tensor product of one axis rule.
class Projection {
 public:
  Projection(const QuadratureRule& rule, int degree);

  int degree() const { return degree_; }
  int pointsPerAxis() const { return points_; }

  /// `samples`: pointsPerAxis()³ values. Returns n(p) coefficients.
  std::vector<double> operator()(std::span<const double> samples) const;

  /// Mean of the squared samples by the same quadrature: ∫Φ² / V.
  double meanSquare(std::span<const double> samples) const;

 private:
  int degree_;
  int points_;
  std::vector<double> weights_;  ///< of the rule, summing to 2
  std::vector<double> rows_;     ///< [i][q] = (2i+1)/2 · w_q · L_i(x_q)
};

/// The coefficients of degree p as the first of degree p+1, the new shell filled from `raised` (paper, sec. 3.3).
std::vector<double> appendTopDegree(std::span<const double> lower, std::span<const double> raised, int raisedDegree);

}  // namespace hpsdf
