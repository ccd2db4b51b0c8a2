#pragma once
// Polynomials of cells whose errors stay within a tolerance.

#include <atomic>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "field/cells/cell_fit.h"
#include "field/cells/surface_points.h"
#include "field/precision/round_coefficients.h"
#include "field/tolerance/cell_lattice.h"
#include "hpsdf/build_options.h"
#include "hpsdf/distance_function.h"

namespace hpsdf::detail {

/// Greatest ratio of an error to the allowed error that a polynomial may have at the checked points. The rest is for
/// errors between them and for the rounding of coefficients.
inline constexpr double kMostRatio = 0.93;

/// The result of fitting polynomials to a cell.
struct ToleranceFit {
  std::optional<Fit> fit;  ///< the polynomial of the lowest degree within the tolerance, if there is one
  Fit closest;             ///< the polynomial with the least error, where none is within the tolerance
  double ratio = 0;        ///< greatest error that was found, of `fit` or of `closest`, over the allowed error
  bool jumps = false;      ///< the distance jumps in the cell, so that no polynomial can follow it
};

/// Fits polynomials to cells by samples at a lattice of 512 points. The error is checked at these points, at 729 points
/// between them, where the distances at these points suggest kinks, and at points of the surface. A search uphill
/// starts from the worst points. Thread-safe.
class ToleranceFitter {
 public:
  /// Keeps references to the distance and to the progress. `certified` takes only polynomials for which
  /// `isProvenWithin` proves the tolerance in the whole cell. `domain` limits the points at which the proof evaluates
  /// the distance.
  ToleranceFitter(const DistanceFunction& distance, const AllowedError& allowed, const Box& domain, double blend,
                  bool certified, const Progress& progress);

  /// Fits a cell. `ratioAbove` is the `ratio` of the cell's parent: if it is so great that even a smooth distance would
  /// not be within the tolerance in the cell, no polynomial is tried.
  ToleranceFit fit(const Box& cell, double ratioAbove) const;

  const AllowedError& allowed() const { return allowed_; }
  const QuantizationLimits& quantizationLimits() const { return quantizationLimits_; }
  std::uint64_t evaluations() const { return evaluations_; }

 private:
  struct CheckedPoint {
    Vector3 local;
    double distance;  ///< Φ
    double ratio;     ///< |f − Φ| over the allowed error
  };

  std::vector<double> distances(const Box& cell, std::span<const Vector3> local) const;
  std::vector<CheckedPoint> check(const Fit& fit, const Box& cell, std::span<const Vector3> local) const;
  double latticeRatio(std::span<const double> errors, std::span<const double> allowed) const;
  std::vector<CheckedPoint> checkedKinks(const Fit& fit, const Box& cell, std::span<const CheckedPoint> lattice,
                                         std::span<const CheckedPoint> between) const;
  void addSurfacePoints(const Fit& fit, const Box& cell, std::vector<CheckedPoint>& points) const;
  double greatestRatio(const Fit& fit, const Box& cell, std::vector<CheckedPoint> points) const;
  double climb(const Fit& fit, const Box& cell, std::vector<CheckedPoint> tops) const;
  std::vector<CheckedPoint> topsOf(std::vector<CheckedPoint> points) const;
  bool isProven(const Fit& fit, const Box& cell) const;

  const DistanceFunction& distance_;
  std::optional<SurfaceInCells> surface_;  ///< empty for a distance without triangles
  AllowedError allowed_;
  QuantizationLimits quantizationLimits_;
  Box domain_;
  CellLattice lattice_;
  bool certified_;
  const Progress& progress_;
  mutable std::atomic<std::uint64_t> evaluations_ = 0;
};

}  // namespace hpsdf::detail
