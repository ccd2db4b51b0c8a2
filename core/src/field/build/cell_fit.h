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
#include "field/nearness.h"
#include "hpsdf/build_options.h"
#include "hpsdf/distance_function.h"

namespace hpsdf {

/// What a cell's samples carry: its projection onto the highest degree that they are exact for.
struct Projected {
  std::vector<double> coefficients;
  int degree = 0;
  double meanSquare = 0;  ///< of the samples: ∫Φ² / V
};

/// A cell's polynomial and what it counts in the queue.
struct Fit {
  std::vector<double> coefficients;
  int degree = 0;
  CellError error;
  bool outsideBand = false;
  Projected spare;  ///< of the same samples, its degree at least the fit's; kept where refinements may be taken back
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
  /// `nearness` is referred to, and may change between two fits.
  CellFitter(const DistanceFunction& distance, const BuildOptions& options, const Nearness& nearness,
             double nearDistance, const Progress& progress);

  Fit fit(const Box& cell, int degree) const;

  /// Tries what `allowed` names on a cell whose fit is `current`.
  Trial attempt(const Box& cell, const Fit& current, Refinement allowed) const;

  /// Φ at points given by local coordinates.
  std::vector<double> distances(const Box& cell, std::span<const Vector3> local) const;

  /// Calls of Φ so far.
  std::uint64_t evaluations() const { return evaluations_; }
  /// So many have gone before.
  void setEvaluations(std::uint64_t evaluations) { evaluations_ = evaluations; }

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
  /// Of this degree from what the samples carry.
  Fit makeFit(Projected projected, int degree, const Box& cell, bool outsideBand) const;
  double squaredError(const Fit& fit, double meanSquare) const;
  void rate(Fit& fit, double squared, const Box& cell) const;
  bool keepsSpare() const { return options_.criterion == Criterion::optimal; }
  Fit raisedByOwnSamples(const Box& cell, const Fit& current) const;

  const DistanceFunction& distance_;
  const BuildOptions& options_;
  const Nearness& nearness_;
  double nearDistance_;
  const Progress& progress_;
  mutable std::atomic<std::uint64_t> evaluations_ = 0;
  mutable std::array<std::once_flag, kMaxDegree + 1> rulesMade_;
  mutable std::array<std::unique_ptr<const Rules>, kMaxDegree + 1> rules_;
};

}  // namespace hpsdf
