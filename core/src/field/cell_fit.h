#pragma once
// Fitting polynomials to the exact distance in one cell, and the two trials of a refinement.

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "basis/projection.h"
#include "hpsdf/build.h"

namespace hpsdf {

/// A cell's polynomial and what it counts in the queue.
struct Fit {
  std::vector<double> coefficients;
  int degree = 0;
  double error = 0;  ///< weighted by nearness; 0 where the cell lies outside the narrow band
};

/// The outcome of trying both refinements of a cell.
struct Trial {
  std::optional<Fit> raised;                   ///< the same cell one degree higher
  std::optional<std::array<Fit, 8>> children;  ///< its eight children at its own degree
};

enum class Refinement : std::uint8_t { degree, octree, either };

/// Samples Φ and fits. Thread-safe: cells are fitted in parallel.
class CellFitter {
 public:
  CellFitter(const DistanceFunction& distance, const BuildOptions& options, double diagonal, const Progress& progress);

  Fit fit(const Box& cell, int degree) const;

  /// Tries what `allowed` names on a cell whose fit is `current`.
  Trial attempt(const Box& cell, const Fit& current, Refinement allowed) const;

  /// Calls of Φ so far.
  std::uint64_t evaluations() const { return evaluations_; }

 private:
  /// What all cells of one degree p share.
  struct Rules {
    std::unique_ptr<const Projection> projection;  ///< onto degree p+1, whose lower coefficients are those of degree p
    std::vector<std::uint32_t> orderOfOne;         ///< in which a cell's samples are taken; empty: as they are
    std::vector<std::uint32_t> orderOfEight;       ///< the same of eight children, number · points + point
  };

  const Rules& rules(int degree) const;
  /// Their samples, one cell after another; taken in the given order.
  std::vector<double> sample(std::span<const Box> cells, const Projection& projection,
                             std::span<const std::uint32_t> order) const;
  bool outsideBand(const Box& cell, const Projection& projection, std::span<const double> samples) const;
  /// `meanSquare` of the samples that the coefficients come from.
  Fit makeFit(std::vector<double> coefficients, int degree, const Box& cell, double meanSquare, bool outsideBand) const;
  double nearnessWeight(const Fit& fit) const;
  double shellError(const Fit& fit, double volume) const;
  Fit raisedByOwnSamples(const Box& cell, const Fit& current) const;

  const DistanceFunction& distance_;
  const BuildOptions& options_;
  double diagonal_;
  const Progress& progress_;
  mutable std::atomic<std::uint64_t> evaluations_ = 0;
  mutable std::array<std::once_flag, kMaxDegree + 1> rulesMade_;
  mutable std::array<std::unique_ptr<const Rules>, kMaxDegree + 1> rules_;
};

}  // namespace hpsdf
