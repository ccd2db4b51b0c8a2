#pragma once
// L2 projection of samples onto the polynomials of total degree p of a cell.
//
// Coefficients are those of the products L_i L_j L_k with i+j+k ≤ p, in the order of FieldData: lexicographic in
// (i, j, k), k fastest.

#include <array>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "basis/cubature.h"
#include "basis/legendre.h"
#include "hpsdf/detail/legendre_part.h"
#include "hpsdf/types.h"

namespace hpsdf::basis {

/// Calls f(i, j, k, index) for every coefficient of total degree ≤ p, in their order of storage.
template <typename F>
void forEachCoefficient(int degree, F&& f) {
  int index = 0;
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; j <= degree - i; ++j)
      for (int k = 0; k <= degree - i - j; ++k) f(i, j, k, index++);
}

/// ∫ (L_i L_j L_k)² over a cell, divided by its volume.
inline double squaredNorm(int i, int j, int k) { return 1.0 / ((2 * i + 1) * (2 * j + 1) * (2 * k + 1)); }

/// Squared L2 norm of the terms of exactly total degree p, over a cell of this volume (Koschier et al. 2016, eq. 6).
template <typename T>
double topDegreeError(const T* coefficients, int degree, double volume) {
  double sum = 0;
  int end = 0;  // one past the coefficients of (i, j), the last of which has total degree p
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

/// L2 projection of samples at the points of a cubature.
class Projection {
 public:
  virtual ~Projection() = default;

  /// Positions of the samples in [-1, 1]³.
  const std::vector<Vector3>& points() const { return cubature_.points; }
  int degree() const { return degree_; }

  /// The n(p) coefficients for one sample at each point.
  virtual std::vector<double> operator()(std::span<const double> samples) const = 0;

  /// Mean of the squared samples by the same cubature: ∫Φ² / V.
  double meanSquare(std::span<const double> samples) const;

 protected:
  Projection(Cubature cubature, int degree) : cubature_(std::move(cubature)), degree_(degree) {}

  Cubature cubature_;
  int degree_;
};

/// A projection at the tensor product of an axis rule, computed as a contraction of one axis after another.
std::unique_ptr<const Projection> productProjection(const QuadratureRule& axis, int degree);

/// A projection at the points of any cubature, computed as one matrix product.
std::unique_ptr<const Projection> matrixProjection(const Cubature& cubature, int degree);

/// Coefficients of degree p+1: those of degree p from `lower`, those of total degree p+1 from `raised`, because raising
/// the degree keeps the lower coefficients (Koschier et al. 2016, sec. 3.3).
std::vector<double> appendTopDegree(std::span<const double> lower, std::span<const double> raised, int raisedDegree);

/// Returns the coefficients of total degree at most `to`, out of those of `degree`.
std::vector<double> truncated(std::span<const double> coefficients, int degree, int to);

/// The matrices that join the projections of an interval's lower [0] and upper [1] half into the projection of the
/// whole interval: element (i, a) is the contribution of a half's coefficient a ≤ i to coefficient i of the whole.
std::array<detail::LegendreRows, 2> halfShares();

/// The cell's projection from those of its eight children (number x + 2y + 4z), all of one degree. The result equals
/// the projection of all the children's samples.
std::vector<double> joined(const std::array<std::vector<double>, 8>& children, int degree);

}  // namespace hpsdf::basis
