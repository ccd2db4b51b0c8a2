#pragma once
// How much a cell's error counts, and what it adds up to.

#include <algorithm>
#include <cmath>

#include "hpsdf/build_options.h"

namespace hpsdf {

/// κ, by the mean of a cell's field (paper, eq. 10).
struct Nearness {
  NearnessKind kind = NearnessKind::polynomial;
  double exponent = 0;  ///< θ
  double diagonal = 1;  ///< d, of the domain

  double weight(double mean) const {
    const double away = std::abs(mean) / diagonal;
    if (kind == NearnessKind::exponential) return std::exp(-exponent * away);
    return std::pow(std::clamp(1 - away, 0.0, 1.0), exponent);
  }
};

/// What a cell adds to the totals: nothing where it lies outside the narrow band.
struct CellError {
  double weighted = 0;  ///< ε*_e, by nearness
  double squared = 0;   ///< ε_e
  double volume = 0;
  bool near = false;  ///< the cell may hold points near the surface, see `BuildOptions::nearError`
};

/// Over all leaves.
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

/// What the construction is to reach; all lengths in the field's own units.
struct ErrorGoal {
  double weighted = 0;                   ///< τ; ignored where near and far are asked for
  double nearSquare = 0, farSquare = 0;  ///< mean squares asked for; 0: no such goal

  bool byDistance() const { return nearSquare > 0; }
  bool nearReached(const ErrorTotals& totals) const { return totals.nearSquared <= nearSquare * totals.nearVolume; }
  bool farReached(const ErrorTotals& totals) const { return totals.farSquared <= farSquare * totals.farVolume; }
  bool reached(const ErrorTotals& totals) const {
    return byDistance() ? nearReached(totals) && farReached(totals) : totals.weighted <= weighted;
  }
  /// All squares times a factor.
  ErrorGoal times(double factor) const { return {weighted * factor, nearSquare * factor, farSquare * factor}; }
  /// Where totals times a factor are above it, those.
  ErrorGoal relaxedTo(const ErrorTotals& totals, double factor) const {
    if (!byDistance()) return {std::max(weighted, totals.weighted * factor), 0, 0};
    const auto meanSquare = [](double squared, double volume) { return volume > 0 ? squared / volume : 0; };
    return {0, std::max(nearSquare, factor * meanSquare(totals.nearSquared, totals.nearVolume)),
            std::max(farSquare, factor * meanSquare(totals.farSquared, totals.farVolume))};
  }
};

}  // namespace hpsdf
