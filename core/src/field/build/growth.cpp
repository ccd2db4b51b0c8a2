#include "field/build/growth.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

#include "field/build/limits.h"

namespace hpsdf::detail {

using Stage = ConstructionState::Stage;

Growth::Growth(const ConstructionSetup& setup, const CellFitter& fitter, ConstructionState& state, Refiner& refiner,
               const GrowthObserver& observer)
    : setup_(setup), fitter_(fitter), state_(state), refiner_(refiner), observer_(observer) {
  if (state_.stage != Stage::refine) return;
  // A restored state has no queue, which follows from its leaves.
  std::vector<bool> isDeferred(state_.tree.nodes.size());
  for (const std::uint32_t leaf : state_.deferred) isDeferred[leaf] = true;
  for (std::uint32_t n = 0; n < state_.tree.nodes.size(); ++n)
    if (state_.tree.nodes[n].firstChild == 0 && !isDeferred[n]) enqueue(n);
}

void Growth::run() {
  if (state_.stage == Stage::fitBaseCells) fitBaseCells();
  if (observer_.afterStep) observer_.afterStep(state_.steps);
  if (state_.stage == Stage::refine && growsByErrors()) refineWorstCells();
}

void Growth::fitBaseCells() {
  constexpr std::size_t kChunk = 4096;
  BuildTree& tree = state_.tree;
  const std::size_t count = tree.baseCells();
  if (tree.nodes.empty()) tree.addBaseCells();
  const int degree = startDegree(setup_.options);
  while (state_.fittedBaseCells < count) {
    const auto begin = std::size_t(state_.fittedBaseCells);
    setup_.progress.update("fitting base cells", double(begin) / double(count));
    const std::size_t end = std::min(begin + kChunk, count);
    tbb::parallel_for(begin, end,
                      [&](std::size_t n) { tree.nodes[n].fit = fitter_.fit(tree.boxOf(tree.nodes[n]), degree); });
    state_.fittedBaseCells = end;
    observer_.atWholeState();
  }
  state_.coefficients = count * setup_.budget.finalCoefficients(degree);
  if (setup_.goal.byDistance()) chooseNearness();
  refiner_.sumTotals();
  requireRoomForBaseGrid();
  for (std::size_t n = 0; n < count; ++n) enqueue(static_cast<std::uint32_t>(n));
  state_.stage = Stage::refine;
}

void Growth::requireRoomForBaseGrid() const {
  double least = 0;
  for (const BuildNode& node : state_.tree.nodes) {
    const bool mayLower = setup_.options.criterion == Criterion::optimal && !node.fit.outsideBand;
    least += setup_.budget.leafBytes(mayLower ? leastDegree(setup_.options) : node.fit.degree);
  }
  setup_.budget.requireRoomForBaseGrid(refiner_.bytes(), least);
}

/// Chooses θ such that a cell at the mean distance of the far cells weighs less by the ratio of the errors asked for.
void Growth::chooseNearness() {
  double distance = 0, volume = 0;
  for (const BuildNode& node : state_.tree.nodes) {
    if (node.fit.error.near) continue;
    distance += node.fit.error.volume * std::abs(node.fit.coefficients[0]);
    volume += node.fit.error.volume;
  }
  Nearness& nearness = state_.nearness;
  const ErrorGoal& goal = setup_.goal;
  nearness.becomeExponential(
      distance > 0 ? std::log(goal.farSquare / goal.nearSquare) * nearness.diagonal * volume / distance : 0);
  for (BuildNode& node : state_.tree.nodes)
    node.fit.error.weighted = nearness.weight(node.fit.coefficients[0]) * node.fit.error.squared;
}

/// False where the maximum error alone decides what is refined: refining by bytes alone would leave it no room.
bool Growth::growsByErrors() const { return !setup_.options.targetError.isNone() || !(setup_.options.maxError > 0); }

void Growth::refineWorstCells() {
  while (!reachedGoal() && refiner_.mayStep() && (!queue_.empty() || enqueueDeferred())) {
    refineRound();
    // Rounding in the running total must end the construction neither early nor never.
    if (reachedGoal() || state_.totals.weighted < 1e-6 * state_.lastSum) refiner_.sumTotals();
    observer_.atWholeState();
  }
}

void Growth::refineRound() {
  setup_.progress.update("refining", fractionDone());
  refiner_.requireMemory(leastGrowthFactor());
  const std::vector<std::uint32_t> worst = worstLeaves();
  std::vector<Trial> trials = tryAll(worst);
  for (std::size_t w = 0; w < worst.size(); ++w) {
    if (reachedGoal() || !refiner_.mayStep())  // an exact sum may still show that the goal is not reached
      enqueue(worst[w]);
    else
      refine(worst[w], std::move(trials[w]));
  }
}

/// Takes the leaves of a round from the queue and defers those that are exact enough.
std::vector<std::uint32_t> Growth::worstLeaves() {
  constexpr std::size_t kRound = 32;  // few enough to stay close to the paper's order, one cell at a time
  std::vector<std::uint32_t> worst;
  while (worst.size() < kRound && !queue_.empty()) {
    const std::uint32_t next = queue_.top().node;
    queue_.pop();
    (isExactEnough(state_.tree.nodes[next].fit.error) ? state_.deferred : worst).push_back(next);
  }
  return worst;
}

/// Tries leaves in parallel, the most expensive first, so that no thread begins a long trial while others are done.
std::vector<Trial> Growth::tryAll(const std::vector<std::uint32_t>& leaves) const {
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

void Growth::refine(std::uint32_t leaf, Trial&& trial) {
  const BuildNode& node = state_.tree.nodes[leaf];
  const bool raises = refiner_.allowed(node) != Refinement::octree && trial.raised &&
                      (!trial.children || prefersDegree(node.fit, trial));
  refiner_.apply(leaf, std::move(trial), raises);
  if (state_.isFull) return;
  const std::uint32_t first = state_.tree.nodes[leaf].firstChild;
  if (first == 0) return enqueue(leaf);
  for (std::uint32_t child = first; child < first + 8; ++child) enqueue(child);
}

/// Tells whether the cell's kind, near or far, has reached its goal.
bool Growth::isExactEnough(const CellError& cell) const {
  const ErrorGoal& goal = setup_.growthGoal;
  return setup_.goal.byDistance() && (cell.near ? goal.nearReached(state_.totals) : goal.farReached(state_.totals));
}

/// Enqueues the deferred leaves that are not exact enough after all. Returns false where the queue stays empty.
bool Growth::enqueueDeferred() {
  for (const std::uint32_t leaf : std::exchange(state_.deferred, {})) {
    if (isExactEnough(state_.tree.nodes[leaf].fit.error))
      state_.deferred.push_back(leaf);
    else
      enqueue(leaf);
  }
  return !queue_.empty();
}

void Growth::enqueue(std::uint32_t leaf) {
  const BuildNode& node = state_.tree.nodes[leaf];
  if (node.fit.error.weighted > 0 && refiner_.allowed(node)) queue_.push({node.fit.error.weighted, leaf});
}

double Growth::leastGrowthFactor() const {
  const ErrorGoal& goal = setup_.growthGoal;
  const bool endsOtherwise = goal.byDistance() || setup_.options.maxSteps || ByteBudget::isAskedFor(setup_.options);
  if (endsOtherwise || !(goal.weighted > 0)) return 1;
  return progress_.leastFactor(double(fitter_.evaluations()), state_.totals.weighted, goal.weighted);
}

double Growth::fractionDone() {
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
  return std::max(fraction, refiner_.bytes() / setup_.budget.growthLimit());
}

}  // namespace hpsdf::detail
