#pragma once
// L2 projection of samples onto the polynomials of total degree p of a cell.
//
// Coefficients stand in the order of FieldData: lexicographic in (i, j, k), i+j+k ≤ p, k fastest, of plain L_i L_j L_k.

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "basis/cubature.h"
#include "basis/legendre.h"
#include "hpsdf/types.h"

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

/// Projects samples at fixed points of the reference cell.
class Projection {
 public:
  virtual ~Projection() = default;

  /// Where samples stand in [-1, 1]³.
  const std::vector<Vector3>& points() const { return cubature_.points; }
  int degree() const { return degree_; }

  /// Of a sample at each point; n(p) coefficients.
  virtual std::vector<double> operator()(std::span<const double> samples) const = 0;

  /// Mean of the squared samples by the same quadrature: ∫Φ² / V.
  double meanSquare(std::span<const double> samples) const;

 protected:
  Projection(Cubature cubature, int degree) : cubature_(std::move(cubature)), degree_(degree) {}

  Cubature cubature_;
  int degree_;
};

/// From the tensor product of an axis rule: a contraction one axis after another.
std::unique_ptr<const Projection> productProjection(const QuadratureRule& axis, int degree);

/// From any points: one matrix.
std::unique_ptr<const Projection> plainProjection(const Cubature& cubature, int degree);

/// The coefficients of degree p as the first of degree p+1, the new shell filled from `raised` (paper, sec. 3.3).
std::vector<double> appendTopDegree(std::span<const double> lower, std::span<const double> raised, int raisedDegree);

/// Those of the coefficients of `degree` that are of degree `to` at most.
std::vector<double> truncated(std::span<const double> coefficients, int degree, int to);

/// The cell's projection from those of its eight children (number x + 2y + 4z), all of one degree: exactly what the
/// children's samples together would give.
std::vector<double> joined(const std::array<std::vector<double>, 8>& children, int degree);

}  // namespace hpsdf
