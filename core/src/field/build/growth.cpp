#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <queue>
#include <utility>
#include <vector>

#include "field/build/refiner.h"

namespace hpsdf::detail {
namespace {

using Stage = ConstructionState::Stage;

/// Estimates the progress of the refinement from the decay of the error with the work, which is the number of
/// evaluations of the exact distance. The error is assumed to follow a power law of the work. Its exponent is
/// measured over the last tenfold decrease of the error.
class GrowthProgress {
 public:
  /// Records the present work and error. Returns the fraction of the work that is done, which never decreases and
  /// is 1 once the error reaches the target.
  double update(double work, double error, double target) {
    if (error <= target) return 1;
    if (history_.empty() || error < 0.8 * history_.back().error) history_.push_back({work, error});
    const Sample& past = latestAbove(10, error);
    double exponent = 0.7;  // typical of scanned meshes; used until an exponent can be measured
    if (past.error > 2 * error && work > past.work)
      exponent = std::log(work / past.work) / std::log(past.error / error);
    fraction_ = std::max(fraction_, std::min(0.99, std::pow(target / error, exponent)));
    return fraction_;
  }

  /// Returns a lower bound of the final work divided by the present work. The bound assumes that the error falls
  /// exponentially with further work, at its present rate, which is faster than a power law. Returns 1 until the
  /// error has fallen by a factor of 10, because less data does not suffice for an estimate.
  double leastFactor(double work, double error, double target) const {
    if (history_.empty() || !(history_.front().error > 10 * error) || !(error > target)) return 1;
    const Sample& past = latestAbove(3, error);
    if (!(work > past.work)) return 1;
    return 1 + std::log(error / target) * std::log(work / past.work) / std::log(past.error / error);
  }

  /// Returns the final work divided by the present work if the error goes on to fall by a power law of the work.
  /// Returns 1 until the error has fallen by a factor of 10. The exponent is the one of the last tenfold decrease or
  /// that since the start, whichever is smaller: where the facets of a smooth shape come into sight, the error hardly
  /// falls for a while. No more than three further decades are extrapolated, because the error of smooth shapes falls
  /// ever faster.
  double likelyFactor(double work, double error, double target) const {
    if (history_.empty() || !(history_.front().error > 10 * error) || !(error > target)) return 1;
    const Sample &start = history_.front(), &past = latestAbove(10, error);
    if (!(work > past.work)) return 1;
    const auto exponentSince = [&](const Sample& s) { return std::log(work / s.work) / std::log(s.error / error); };
    return std::pow(std::min(error / target, 1e3), std::min(exponentSince(past), exponentSince(start)));
  }

 private:
  struct Sample {
    double work, error;
  };

  /// Returns the latest sample whose error was more than `factor` times `error`; the first sample if there is none.
  const Sample& latestAbove(double factor, double error) const {
    const auto latest =
        std::find_if(history_.rbegin(), history_.rend(), [&](const Sample& s) { return s.error > factor * error; });
    return latest == history_.rend() ? history_.front() : *latest;
  }

  std::vector<Sample> history_;
  double fraction_ = 0;
};

/// Grows the octree by refining the leaves of a priority queue in rounds. The refinements of a round are tried
/// in parallel but applied in the order of the queue, so that the result does not depend on the number of
/// threads.
class Growth {
 public:
  explicit Growth(Refiner& refiner)
      : setup_(refiner.setup), fitter_(refiner.fitter), state_(refiner.state), refiner_(refiner) {
    if (state_.stage != Stage::refine) return;
    // Rebuild the queue from the leaves, because a restored state does not contain the queue.
    std::vector<bool> isDeferred(state_.tree.nodes.size());
    for (const std::uint32_t leaf : state_.deferred) isDeferred[leaf] = true;
    for (std::uint32_t n = 0; n < state_.tree.nodes.size(); ++n)
      if (state_.tree.nodes[n].firstChild == 0 && !isDeferred[n]) enqueue(n);
  }

  void run() {
    if (state_.stage == Stage::fitFirstCells) fitFirstCells();
    if (refiner_.observer.afterStep) refiner_.observer.afterStep(state_.steps);
    if (state_.stage == Stage::refine && growsByErrors()) refineWorstCells();
  }

 private:
  struct Entry {
    double error;
    std::uint32_t node;
    bool operator<(const Entry& other) const { return std::pair(error, other.node) < std::pair(other.error, node); }
  };

  /// Returns true if the errors are small enough to end the refinement.
  bool reachedGoal() const { return setup_.growthGoal.reached(state_.totals); }

  void fitFirstCells() {
    constexpr std::size_t kChunk = 4096;
    BuildTree& tree = state_.tree;
    if (tree.nodes.empty()) tree.addBaseCells();
    if (state_.fittedCells == 0 && setup_.exactCells) {
      const auto smooth = [&](const Box& cell) { return refiner_.smoothFit(cell); };
      placeExactLeaves(
          tree, *setup_.exactCells, smooth, setup_.options.maxDepth, setup_.progress,
          [&](const ExactEstimate& soFar) { requireMemoryForExact(soFar, setup_.distance.bytes(), setup_.options); });
    }
    const std::size_t count = tree.nodes.size();
    while (state_.fittedCells < count) {
      const auto begin = std::size_t(state_.fittedCells);
      setup_.progress.update("fitting first cells", double(begin) / double(count));
      const std::size_t end = std::min(begin + kChunk, count);
      tbb::parallel_for(begin, end, [&](std::size_t n) {
        BuildNode& node = tree.nodes[n];
        if (node.firstChild == 0 && !node.fit.isFinal) node.fit = refiner_.firstFit(tree.boxOf(node));
      });
      state_.fittedCells = end;
      refiner_.observer.atWholeState();
    }
    for (const BuildNode& node : tree.nodes)
      if (node.firstChild == 0) state_.coefficients += setup_.budget.finalCoefficients(node.fit);
    state_.exactSize = setup_.exactSize(tree);
    if (setup_.goal.byDistance()) chooseNearness();
    refiner_.sumTotals();
    refiner_.countCoefficientBytes();
    requireRoomForFirstCells();
    for (std::size_t n = 0; n < count; ++n)
      if (tree.nodes[n].firstChild == 0) enqueue(static_cast<std::uint32_t>(n));
    state_.stage = Stage::refine;
  }

  void requireRoomForFirstCells() const {
    const auto bytesOfNode = [&](double coefficients) {
      return setup_.budget.nodeBytes() + state_.coefficientBytes * coefficients;
    };
    double least = state_.exactSize.inField;
    for (const BuildNode& node : state_.tree.nodes) {
      if (node.firstChild != 0 || node.fit.isFinal) {
        least += bytesOfNode(double(node.fit.coefficients.size()));
        continue;
      }
      const bool mayLower = setup_.options.criterion == Criterion::optimal && !node.fit.outsideBand;
      const int degree = mayLower ? leastDegree(setup_.options) : node.fit.degree;
      least += bytesOfNode(double(setup_.budget.finalCoefficients(degree)));
    }
    setup_.budget.requireRoomForFirstCells(refiner_.bytes(), least, state_.exactSize.inField);
  }

  /// Chooses the exponent θ of the weight by which errors far from the surface count less. With this θ, a cell at the
  /// mean distance of the far cells has the weight (near error / far error)². Both errors are the user's target errors.
  void chooseNearness() {
    double distance = 0, volume = 0;
    for (const BuildNode& node : state_.tree.nodes) {
      if (node.firstChild != 0 || node.fit.isFinal || node.fit.error.near) continue;
      distance += node.fit.error.volume * std::abs(node.fit.coefficients[0]);
      volume += node.fit.error.volume;
    }
    Nearness& nearness = state_.nearness;
    const ErrorGoal& goal = setup_.goal;
    nearness.kind = NearnessKind::exponential;
    nearness.exponent =
        distance > 0 ? std::log(goal.farSquare / goal.nearSquare) * nearness.diagonal * volume / distance : 0;
    for (BuildNode& node : state_.tree.nodes)
      if (node.firstChild == 0 && !node.fit.isFinal)
        node.fit.error.weighted = nearness.weight(node.fit.coefficients[0]) * node.fit.error.squared;
  }

  /// Returns false if the goal of the construction is a maximum error alone. Refinement by the integrated errors
  /// of cells would then use up the bytes that the refinement by the maximum error needs.
  bool growsByErrors() const { return !setup_.options.targetError.isNone() || !(setup_.options.maxError > 0); }

  void refineWorstCells() {
    while (!reachedGoal() && refiner_.mayStep() && (!queue_.empty() || enqueueDeferred())) {
      refineRound();
      // Sum the errors anew if rounding errors of the running total could end the construction too early or keep
      // it from ending.
      if (reachedGoal() || state_.totals.weighted < 1e-6 * state_.lastSum) refiner_.sumTotals();
      refiner_.observer.atWholeState();
    }
  }

  void refineRound() {
    setup_.progress.update("refining", fractionDone());
    refiner_.requireMemory(growthFactor(&GrowthProgress::leastFactor), growthFactor(&GrowthProgress::likelyFactor));
    const std::vector<std::uint32_t> worst = worstLeaves();
    std::vector<Trial> trials = tryAll(worst);
    for (std::size_t w = 0; w < worst.size(); ++w) {
      if (reachedGoal() || !refiner_.mayStep())  // keep the leaf: an exact sum may still show that the goal is missed
        enqueue(worst[w]);
      else
        refine(worst[w], std::move(trials[w]));
    }
  }

  /// Takes the leaves with the greatest errors from the queue. Sets aside the leaves near the surface if the near error
  /// has reached its goal, and the leaves far from the surface if the far error has reached its goal.
  std::vector<std::uint32_t> worstLeaves() {
    constexpr std::size_t kRound = 32;  // few leaves at a time, because the paper refines cells one by one
    std::vector<std::uint32_t> worst;
    while (worst.size() < kRound && !queue_.empty()) {
      const std::uint32_t next = queue_.top().node;
      queue_.pop();
      (isExactEnough(state_.tree.nodes[next].fit.error) ? state_.deferred : worst).push_back(next);
    }
    return worst;
  }

  /// Computes the trial refinements of leaves in parallel. The most expensive leaves come first, so that no
  /// thread begins a long trial when the other threads are already done.
  std::vector<Trial> tryAll(const std::vector<std::uint32_t>& leaves) const {
    const auto node = [&](std::size_t n) -> const BuildNode& { return state_.tree.nodes[leaves[n]]; };
    std::vector<std::size_t> order(leaves.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, std::greater(), [&](std::size_t n) { return node(n).fit.degree; });
    std::vector<Trial> trials(leaves.size());
    std::atomic<std::size_t> next = 0;
    tbb::parallel_for(
        0, tbb::this_task_arena::max_concurrency(),
        [&](int) {
          for (std::size_t taken = next++; taken < order.size(); taken = next++)
            trials[order[taken]] = refiner_.attempt(node(order[taken]), *refiner_.allowed(node(order[taken])));
        },
        tbb::simple_partitioner{});
    return trials;
  }

  void refine(std::uint32_t leaf, Trial&& trial) {
    const bool raises = refiner_.raises(state_.tree.nodes[leaf], trial);
    refiner_.apply(leaf, std::move(trial), raises);
    if (state_.isFull) return;
    const std::uint32_t first = state_.tree.nodes[leaf].firstChild;
    if (first == 0) return enqueue(leaf);
    for (std::uint32_t child = first; child < first + 8; ++child) enqueue(child);
  }

  /// Returns true if an error total has reached its goal: the near error if the cell is near the surface, else the far
  /// error.
  bool isExactEnough(const CellError& cell) const {
    const ErrorGoal& goal = setup_.growthGoal;
    return setup_.goal.byDistance() && (cell.near ? goal.nearReached(state_.totals) : goal.farReached(state_.totals));
  }

  /// Puts leaves that were set aside back into the queue: near leaves if the near error no longer meets its goal, and
  /// far leaves if the far error no longer meets its goal. Returns false if the queue stays empty.
  bool enqueueDeferred() {
    for (const std::uint32_t leaf : std::exchange(state_.deferred, {})) {
      if (isExactEnough(state_.tree.nodes[leaf].fit.error))
        state_.deferred.push_back(leaf);
      else
        enqueue(leaf);
    }
    return !queue_.empty();
  }

  void enqueue(std::uint32_t leaf) {
    const BuildNode& node = state_.tree.nodes[leaf];
    if (node.fit.error.weighted > 0 && refiner_.allowed(node)) queue_.push({node.fit.error.weighted, leaf});
  }

  /// Returns one of the factors of `GrowthProgress`, or 1 if the construction does not end at a weighted error.
  double growthFactor(double (GrowthProgress::*factor)(double, double, double) const) const {
    const ErrorGoal& goal = setup_.growthGoal;
    const bool endsOtherwise = goal.byDistance() || setup_.options.maxSteps || setup_.options.maxBytes;
    if (endsOtherwise || !(goal.weighted > 0)) return 1;
    return (progress_.*factor)(double(fitter_.evaluations()), state_.totals.weighted, goal.weighted);
  }

  double fractionDone() {
    const ErrorGoal& goal = setup_.growthGoal;
    const ErrorTotals& totals = state_.totals;
    double fraction = 0;
    if (goal.byDistance()) {
      const double near = totals.nearSquared / (goal.nearSquare * totals.nearVolume);
      const double far = totals.farSquared / (goal.farSquare * totals.farVolume);
      fraction = progress_.update(double(fitter_.evaluations()), std::fmax(near, far), 1);
    } else if (goal.weighted > 0) {
      fraction = progress_.update(double(fitter_.evaluations()), totals.weighted, goal.weighted);
    }
    if (setup_.options.maxSteps) fraction = std::max(fraction, double(state_.steps) / double(*setup_.options.maxSteps));
    return std::max(fraction, refiner_.bytes() / setup_.budget.growthLimit(state_.exactSize.inField));
  }

  const ConstructionSetup& setup_;
  const CellFitter& fitter_;
  ConstructionState& state_;
  Refiner& refiner_;
  std::priority_queue<Entry> queue_;
  GrowthProgress progress_;
};

}  // namespace

void growByErrors(Refiner& refiner) { Growth(refiner).run(); }

}  // namespace hpsdf::detail
