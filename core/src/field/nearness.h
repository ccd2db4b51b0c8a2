#pragma once
// Errors of cells, weighted by nearness to the surface; the totals of these errors; and the error goal of a
// construction.

#include <algorithm>
#include <cmath>

#include "hpsdf/build_options.h"

namespace hpsdf::detail {

/// The weight κ of a cell, which depends on the mean of the field in the cell (paper, eq. 10).
struct Nearness {
  NearnessKind kind = NearnessKind::polynomial;
  double exponent = 0;  ///< θ
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

/// The contribution of a cell to the error totals. All numbers are 0 for a cell outside the narrow band.
struct CellError {
  double weighted = 0;  ///< ε*_e: the squared error times κ, in units^5
  double squared = 0;   ///< ε_e, in units^5
  double volume = 0;
  bool near = false;  ///< the cell may hold points near the surface, see `NearFarError::nearDistance`
};

/// Sums of the cell errors and of the volumes over all leaves, in units^5 and units^3.
struct ErrorTotals {
  double weighted = 0;
  double nearSquared = 0, nearVolume = 0;
  double farSquared = 0, farVolume = 0;

  void add(const CellError& cell, int times = 1) {
    weighted += times * cell.weighted;
    (cell.near ? nearSquared : farSquared) += times * cell.squared;
    (cell.near ? nearVolume : farVolume) += times * cell.volume;
  }
};

/// The errors at which the construction ends, in the units of the field.
struct ErrorGoal {
  double weighted = 0;                   ///< τ in units^5; 0 where errors by distance are asked for
  double nearSquare = 0, farSquare = 0;  ///< mean squares to reach, in units^2; 0: not asked for

  bool byDistance() const { return nearSquare > 0; }
  bool nearReached(const ErrorTotals& totals) const { return totals.nearSquared <= nearSquare * totals.nearVolume; }
  bool farReached(const ErrorTotals& totals) const { return totals.farSquared <= farSquare * totals.farVolume; }
  bool reached(const ErrorTotals& totals) const {
    return byDistance() ? nearReached(totals) && farReached(totals) : totals.weighted <= weighted;
  }
  /// Returns the goal with all its squared errors multiplied by `factor`.
  ErrorGoal times(double factor) const { return {weighted * factor, nearSquare * factor, farSquare * factor}; }
  /// Returns a relaxed goal: each error of the goal, or `factor` times the present error in `totals` if that is
  /// greater.
  ErrorGoal relaxedTo(const ErrorTotals& totals, double factor) const {
    if (!byDistance()) return {std::max(weighted, totals.weighted * factor), 0, 0};
    const auto meanSquare = [](double squared, double volume) { return volume > 0 ? squared / volume : 0; };
    return {0, std::max(nearSquare, factor * meanSquare(totals.nearSquared, totals.nearVolume)),
            std::max(farSquare, factor * meanSquare(totals.farSquared, totals.farVolume))};
  }
};

}  // namespace hpsdf::detail
