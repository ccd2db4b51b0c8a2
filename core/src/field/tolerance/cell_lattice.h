#pragma once
// A lattice of points in a cell, and least-squares fits of polynomials to samples at these points.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "field/cells/probes.h"
#include "hpsdf/types.h"

namespace hpsdf::detail {

/// The lattice of 8 × 8 × 8 points at which a cell is probed (`ProbeLattice`), scaled about the cell's centre, with
/// least-squares fits of the polynomials of low total degree to samples at these points. Points are in local
/// coordinates of the cell.
class CellLattice {
 public:
  /// The points of a lattice on a line along an axis, from one end of the lattice to the other.
  struct Line {
    int axis = 0;
    std::vector<std::uint32_t> points;  ///< their indices
  };

  static constexpr int kLongestLine = ProbeLattice::kAcross + 1;
  static constexpr int kMostDegree = 5;  ///< 56 coefficients; with more of them, errors between the points grow

  /// The lattice reaches from −`reach` to `reach` along each axis.
  explicit CellLattice(double reach);

  /// Points of the lattice, in blocks of eight neighbours.
  std::span<const Vector3> points() const { return points_; }
  /// Points halfway between those of the lattice, in the interior, on the faces and on the edges of the cell.
  std::span<const Vector3> pointsBetween() const { return between_; }
  /// Pairs of neighbours in `points()`.
  std::span<const std::pair<std::uint32_t, std::uint32_t>> neighbours() const { return probeLattice().neighbours; }
  /// All lines in `points()`, and in `pointsBetween()`, where the first and the last interval are half as long.
  std::span<const Line> lines() const { return lines_; }
  std::span<const Line> linesBetween() const { return linesBetween_; }
  /// Distance between two neighbours along an axis.
  double spacing() const { return spacing_; }
  double reach() const { return reach_; }

  /// Returns the coefficients of the polynomial of degree 1 to `kMostDegree` with the least sum of squared errors.
  std::vector<double> fit(std::span<const double> samples, int degree) const;
  /// Returns the values of a polynomial at `points()`.
  std::vector<double> valuesOf(std::span<const double> coefficients, int degree) const;

 private:
  struct Matrices {
    Eigen::MatrixXd values;  ///< maps coefficients to values at the points
    Eigen::MatrixXd fit;     ///< maps values at the points to coefficients: the pseudoinverse of `values`
  };

  double reach_, spacing_;
  std::vector<Vector3> points_, between_;
  std::vector<Line> lines_, linesBetween_;
  std::array<Matrices, kMostDegree + 1> matrices_;  ///< by degree; there are none for degree 0
};

}  // namespace hpsdf::detail
