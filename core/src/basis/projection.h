#pragma once
// L2 projection of samples within a cell onto the polynomials of total degree at most p.
//
// The coefficients belong to the products L_i L_j L_k with i+j+k ≤ p. They are stored as in FieldData: in lexicographic
// order of (i, j, k), k fastest.

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

/// Calls f(i, j, k, index) for every coefficient with i + j + k ≤ degree, in the order in which coefficients
/// are stored.
template <typename F>
void forEachCoefficient(int degree, F&& f) {
  int index = 0;
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; j <= degree - i; ++j)
      for (int k = 0; k <= degree - i - j; ++k) f(i, j, k, index++);
}

/// Returns ∫ (L_i L_j L_k)² over a cell, divided by the volume of the cell.
inline double squaredNorm(int i, int j, int k) { return 1.0 / ((2 * i + 1) * (2 * j + 1) * (2 * k + 1)); }

/// Returns the squared L2 norm, over a cell of this volume, of a polynomial's terms of total degree `degree` (Koschier
/// et al. 2016, eq. 6).
template <typename T>
double topDegreeError(const T* coefficients, int degree, double volume) {
  double sum = 0;
  int end = 0;  // one past the last coefficient with these i and j, whose total degree is `degree`
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

/// L2 projection of a function onto polynomials, from samples of the function at the points of a cubature.
class Projection {
 public:
  virtual ~Projection() = default;

  /// Positions of the samples in [-1, 1]³.
  const std::vector<Vector3>& points() const { return cubature_.points; }
  int degree() const { return degree_; }

  /// Returns true if a sample consists of four numbers: the function's value and its derivatives along the three axes
  /// of [-1, 1]³. Else it is the value alone.
  virtual bool takesGradients() const { return false; }
  std::size_t numbersPerPoint() const { return takesGradients() ? 4 : 1; }

  /// Returns the n(p) coefficients of the projection, given one sample at each point.
  virtual std::vector<double> operator()(std::span<const double> samples) const = 0;

  /// Returns the mean square of a function over the cell, computed from its samples. `coefficients` are those of the
  /// projection of these samples.
  virtual double meanSquare(std::span<const double> samples, std::span<const double> coefficients) const;

 protected:
  Projection(Cubature cubature, int degree) : cubature_(std::move(cubature)), degree_(degree) {}

  Cubature cubature_;
  int degree_;
};

/// Returns an object that computes L2 projections from samples at the tensor product of a one-dimensional quadrature
/// rule. It contracts the samples along one axis after another.
std::unique_ptr<const Projection> productProjection(const QuadratureRule& axis, int degree);

/// Returns an object that computes L2 projections from samples at the points of any cubature. It multiplies the samples
/// by one matrix.
std::unique_ptr<const Projection> matrixProjection(const Cubature& cubature, int degree);

/// Returns coefficients of degree p+1: the terms up to total degree p come from `lower`, the terms of total degree p+1
/// from `raised`. The terms fit together because raising the degree of an L2 projection does not change the lower
/// coefficients (Koschier et al. 2016, sec. 3.3).
std::vector<double> appendTopDegree(std::span<const double> lower, std::span<const double> raised, int raisedDegree);

/// Returns the coefficients whose total degree is at most `to`, out of the coefficients of a polynomial of
/// degree `degree`.
std::vector<double> truncated(std::span<const double> coefficients, int degree, int to);

/// Returns two matrices that join the projections on the lower half [0] and the upper half [1] of an interval into the
/// projection on the whole interval. Element (i, a), a ≤ i, is the factor with which coefficient a on the half
/// contributes to coefficient i on the whole interval.
std::array<detail::LegendreRows, 2> halfShares();

/// Joins the projections of a cell's eight children (number x + 2y + 4z), all of the same degree, into the projection
/// of the whole cell. The result equals the projection of the samples of all children.
std::vector<double> joined(const std::array<std::vector<double>, 8>& children, int degree);

}  // namespace hpsdf::basis
