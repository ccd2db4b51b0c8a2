#pragma once
// Errors of octree cells, their sums, and the error at which the construction of a field ends. Errors near the
// surface count more than errors far away.

#include <algorithm>
#include <cmath>

#include "hpsdf/build_options.h"
#include "util/exact_sum.h"

namespace hpsdf::detail {

/// The weight κ of a cell's error (paper, eq. 10). It falls with the cell's distance from the surface, which is
/// estimated by the mean of the field in the cell.
struct Nearness {
  NearnessKind kind = NearnessKind::polynomial;
  double exponent = 0;  ///< θ: the greater it is, the less errors far from the surface count
  double diagonal = 1;  ///< d, length of the domain's diagonal

  double weight(double mean) const {
    const double distance = std::abs(mean) / diagonal;
    if (kind == NearnessKind::exponential) return std::exp(-exponent * distance);
    return std::pow(std::clamp(1 - distance, 0.0, 1.0), exponent);
  }
};

inline Nearness nearnessOf(const BuildOptions& settings, const Box& domain) {
  return {settings.nearnessKind, settings.nearness, domain.diagonal().norm()};
}

/// The error of one cell as it enters the sums over all cells. All numbers are 0 for a cell outside the narrow band.
struct CellError {
  double weighted = 0;  ///< ε*_e: `squared` times the weight κ
  double squared = 0;   ///< ε_e: integral of the squared error over the cell
  double volume = 0;
  bool near = false;  ///< the cell may hold points within `NearFarError::nearDistance` of the surface
};

/// Sums of errors and volumes over all leaves. Squared errors and volumes are summed separately for the leaves near the
/// surface and the leaves far from it.
struct ErrorTotals {
  double weighted = 0;
  double nearSquared = 0, nearVolume = 0;
  double farSquared = 0, farVolume = 0;

  void add(const CellError& cell) {
    weighted += cell.weighted;
    (cell.near ? nearSquared : farSquared) += cell.squared;
    (cell.near ? nearVolume : farVolume) += cell.volume;
  }
};

/// The sums of `ErrorTotals` without rounding. They do not depend on the order in which leaves are added, nor on leaves
/// that were added and taken away again.
class ExactTotals {
 public:
  void add(const CellError& cell, int times = 1) {
    weighted_.add(cell.weighted, times);
    (cell.near ? nearSquared_ : farSquared_).add(cell.squared, times);
    (cell.near ? nearVolume_ : farVolume_).add(cell.volume, times);
  }
  ErrorTotals rounded() const {
    return {weighted_.value(), nearSquared_.value(), nearVolume_.value(), farSquared_.value(), farVolume_.value()};
  }
  /// Calls f with each of the sums, in a fixed order.
  template <typename F>
  void forEachSum(const F& f) {
    for (ExactSum* sum : {&weighted_, &nearSquared_, &nearVolume_, &farSquared_, &farVolume_}) f(*sum);
  }

 private:
  ExactSum weighted_, nearSquared_, nearVolume_, farSquared_, farVolume_;
};

/// The errors at which the construction ends. Lengths are in the units of the field.
struct ErrorGoal {
  double weighted = 0;  ///< τ: bound of `ErrorTotals::weighted`; 0 if near and far errors are the goal
  double nearSquare = 0, farSquare = 0;  ///< goals of the mean squared errors near and far from the surface; 0: none

  bool byDistance() const { return nearSquare > 0; }
  bool nearReached(const ErrorTotals& totals) const { return totals.nearSquared <= nearSquare * totals.nearVolume; }
  bool farReached(const ErrorTotals& totals) const { return totals.farSquared <= farSquare * totals.farVolume; }
  bool reached(const ErrorTotals& totals) const {
    return byDistance() ? nearReached(totals) && farReached(totals) : totals.weighted <= weighted;
  }
  /// Returns the goal with all its squared errors multiplied by `factor`.
  ErrorGoal times(double factor) const { return {weighted * factor, nearSquare * factor, farSquare * factor}; }
  /// Returns a relaxed goal. Each of its errors is the greater one of this goal's error and `factor` times the
  /// present error in `totals`.
  ErrorGoal relaxedTo(const ErrorTotals& totals, double factor) const {
    if (!byDistance()) return {std::max(weighted, totals.weighted * factor), 0, 0};
    const auto meanSquare = [](double squared, double volume) { return volume > 0 ? squared / volume : 0; };
    return {0, std::max(nearSquare, factor * meanSquare(totals.nearSquared, totals.nearVolume)),
            std::max(farSquare, factor * meanSquare(totals.farSquared, totals.farVolume))};
  }
};

}  // namespace hpsdf::detail
