#pragma once
// The growth of the octree from its base cells (paper, Algorithm 1).

#include <cstdint>
#include <queue>
#include <vector>

#include "field/build/growth_progress.h"
#include "field/build/refiner.h"

namespace hpsdf::detail {

/// Fits the base cells and refines the leaves of greatest error until the goal is reached. The queue is served in
/// rounds: refinements of a round are tried in parallel and applied in the order of the queue, so that the result does
/// not depend on the number of threads.
class Growth {
 public:
  Growth(const ConstructionSetup& setup, const CellFitter& fitter, ConstructionState& state, Refiner& refiner,
         const GrowthObserver& observer);

  void run();

  /// False where the growth ended early, by steps or bytes.
  bool reachedGoal() const { return setup_.growthGoal.reached(state_.totals); }

 private:
  struct Entry {
    double error;
    std::uint32_t node;
    bool operator<(const Entry& other) const {
      return error < other.error || (error == other.error && node > other.node);
    }
  };

  void fitBaseCells();
  void requireRoomForBaseGrid() const;
  void chooseNearness();
  bool growsByErrors() const;
  void refineWorstCells();
  void refineRound();
  std::vector<std::uint32_t> worstLeaves();
  std::vector<Trial> tryAll(const std::vector<std::uint32_t>& leaves) const;
  void refine(std::uint32_t leaf, Trial&& trial);
  bool isExactEnough(const CellError& cell) const;
  bool enqueueDeferred();
  void enqueue(std::uint32_t leaf);
  double fractionDone();
  double leastGrowthFactor() const;

  const ConstructionSetup& setup_;
  const CellFitter& fitter_;
  ConstructionState& state_;
  Refiner& refiner_;
  const GrowthObserver& observer_;
  std::priority_queue<Entry> queue_;
  GrowthProgress progress_;
};

}  // namespace hpsdf::detail
