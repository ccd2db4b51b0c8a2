#pragma once
// Refinement of single leaves: what is allowed, what is tried, what is applied.

#include <functional>
#include <optional>

#include "field/build/byte_budget.h"
#include "field/build/construction_state.h"
#include "field/cells/cell_fit.h"

namespace hpsdf::detail {

/// The goal of a construction, and what all its stages share.
struct ConstructionSetup {
  const DistanceFunction& distance;
  const BuildOptions& options;
  const Progress& progress;
  double referenceLength;  ///< L
  ErrorGoal goal;
  ErrorGoal growthGoal;  ///< beyond `goal` where pruning follows
  const ByteBudget& budget;
};

/// Calls back while the octree grows.
struct GrowthObserver {
  /// Called with the number of steps: 0 once the base cells are fitted, then after each step. May be empty.
  std::function<void(std::uint64_t steps)> afterStep;
  /// Called where the state is whole and may be kept.
  std::function<void()> atWholeState;
};

/// Applies refinements to the octree of a state and keeps its sums up to date.
class Refiner {
 public:
  Refiner(const ConstructionSetup& setup, const CellFitter& fitter, ConstructionState& state,
          const GrowthObserver& observer)
      : setup_(setup), fitter_(fitter), state_(state), observer_(observer) {}

  /// Returns nothing where the leaf has reached the limits of degree and depth.
  std::optional<Refinement> allowed(const BuildNode& leaf) const;
  /// False once the limit of steps or bytes is reached.
  bool mayStep() const;

  /// Tries the allowed refinements of a leaf. Thread-safe.
  Trial attempt(const BuildNode& leaf, Refinement allowed) const {
    return fitter_.attempt(state_.tree.boxOf(leaf), leaf.fit, allowed);
  }

  /// Raises the degree of a leaf or splits it as tried, unless the limit of bytes forbids it: then the state is full.
  void apply(std::uint32_t leaf, Trial&& trial, bool raises);

  /// Sums the totals exactly.
  void sumTotals();
  /// Bytes of the field so far, by the budget's count.
  double bytes() const { return setup_.budget.bytes(double(state_.tree.nodes.size()), double(state_.coefficients)); }
  /// Throws `Error` where the octree exceeds memory, or will when `factor` times as much has grown.
  void requireMemory(double factor = 1) const;

 private:
  const ConstructionSetup& setup_;
  const CellFitter& fitter_;
  ConstructionState& state_;
  const GrowthObserver& observer_;
};

/// The hp decision (paper, eqs. 7 to 9), with errors weighted by nearness: whether a higher degree reduces the error
/// more for each coefficient than a split. The trial has both.
bool prefersDegree(const Fit& current, const Trial& trial);

ErrorTotals sumOfErrors(const BuildTree& tree);

}  // namespace hpsdf::detail
