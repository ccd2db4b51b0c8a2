#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "field/build/refiner.h"
#include "field/shares/leaf_queue.h"
#include "field/shares/shares.h"

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

/// A leaf that is refined in a round.
struct Chosen {
  LeafRank leaf;
  int rank = 0;            ///< the process that holds it
  std::uint32_t node = 0;  ///< its number, if this process holds it
};

template <typename Stream>
void errorItems(Stream& stream, CellError& error) {
  stream.item(error.weighted);
  stream.item(error.squared);
  stream.item(error.volume);
  stream.flag(error.near);
}

/// Writes or reads the errors of a refinement.
template <typename Stream>
void errorItems(Stream& stream, StepErrors& errors) {
  errorItems(stream, errors.before);
  auto count = static_cast<std::uint8_t>(errors.after.size());
  stream.item(count);
  errors.after.resize(count);
  for (CellError& error : errors.after) errorItems(stream, error);
}

/// Grows the octree by refining the leaves of a priority queue in rounds. The refinements of a round are tried
/// in parallel but applied in the order of the queue, so that the result does not depend on the number of
/// threads. If several processes build the field, each of them holds and refines a part of the leaves. All know the
/// errors before and after each refinement, and therefore the sums of errors; while a process waits for others, it
/// tries leaves ahead of their turn.
class Growth {
 public:
  explicit Growth(Refiner& refiner)
      : setup_(refiner.setup),
        fitter_(refiner.fitter),
        state_(refiner.state),
        refiner_(refiner),
        queue_(refiner.state.tree) {
    if (state_.stage == Stage::refine) enqueueLeaves();
  }

  void run() {
    if (state_.stage == Stage::fitFirstCells) fitFirstCells();
    divideWhenDue();
    if (refiner_.observer.afterStep) refiner_.observer.afterStep(state_.steps);
    if (state_.stage == Stage::refine && growsByErrors()) refineWorstCells();
    fitter_.takeBack(std::exchange(refiner_.aheadOfTurn, 0));
  }

 private:
  static constexpr std::size_t kRound = 32;  // few leaves at a time, because the paper refines cells one by one

  Shares* shares() const { return refiner_.shares; }
  int ownRank() const { return shares() != nullptr ? shares()->rank() : 0; }

  /// Returns true if the errors are small enough to end the refinement.
  bool reachedGoal() const { return setup_.growthGoal.reached(state_.totals.rounded()); }

  /// Fills the queue with the leaves of the octree, because a restored state does not contain the queue.
  void enqueueLeaves() {
    std::vector<bool> isDeferred(state_.tree.nodes.size());
    for (const std::uint32_t leaf : state_.deferred) isDeferred[leaf] = true;
    for (std::uint32_t n = 0; n < state_.tree.nodes.size(); ++n)
      if (state_.tree.nodes[n].firstChild == 0 && !isDeferred[n]) enqueue(n);
  }

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
      if (shares() == nullptr) refiner_.observer.atWholeState();
    }
    if (setup_.goal.byDistance()) chooseNearness();
    refiner_.countAll();
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
    ExactSum distances, volumes;
    for (const BuildNode& node : state_.tree.nodes) {
      if (node.firstChild != 0 || node.fit.isFinal || node.fit.error.near) continue;
      distances.add(node.fit.error.volume * std::abs(node.fit.coefficients[0]));
      volumes.add(node.fit.error.volume);
    }
    if (shares() != nullptr)
      for (ExactSum* sum : {&distances, &volumes}) shares()->add(*sum);
    const double distance = distances.value(), volume = volumes.value();
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
    if (shares() != nullptr) evaluations_ = shares()->sum(fitter_.evaluations());
    while (!reachedGoal() && refiner_.mayStep() && refineRound()) divideWhenDue();
  }

  /// Refines the leaves with the greatest errors. Returns false if there are none.
  bool refineRound() {
    if (shares() == nullptr) evaluations_ = fitter_.evaluations();
    setup_.progress.update("refining", fractionDone());
    refiner_.requireMemory(growthFactor(&GrowthProgress::leastFactor), growthFactor(&GrowthProgress::likelyFactor));
    bool isDue = shares() == nullptr;
    const std::vector<Chosen> worst = shares() != nullptr ? chooseWorstOfAll(isDue) : chooseWorst();
    if (worst.empty()) return enqueueDeferred();
    tryMissing(worst);
    const std::vector<StepErrors> errors = shares() != nullptr ? shareErrors(worst) : std::vector<StepErrors>{};
    for (std::size_t w = 0; w < worst.size(); ++w) {
      const bool isOwn = worst[w].rank == ownRank(), mayRefine = !reachedGoal() && refiner_.mayStep();
      if (isOwn && mayRefine)
        refine(worst[w].node);
      else if (isOwn)
        queue_.push(worst[w].node);
      else if (mayRefine)
        refiner_.countStep(errors[w]);
    }
    if (isDue) refiner_.observer.atWholeState();
    return true;
  }

  /// Takes leaves with the greatest errors from the queue. Sets aside the leaves near the surface if the near error
  /// has reached its goal, and the leaves far from the surface if the far error has reached its goal.
  std::vector<Chosen> chooseWorst() {
    std::vector<Chosen> worst;
    while (worst.size() < kRound && !queue_.isEmpty()) {
      const std::uint32_t leaf = queue_.pop();
      if (isExactEnough(state_.tree.nodes[leaf].fit.error))
        state_.deferred.push_back(leaf);
      else
        worst.push_back({queue_.rankOf(leaf), ownRank(), leaf});
    }
    return worst;
  }

  /// Does what `chooseWorst` does with the leaves of all processes. Sets `isDue` if the state should be saved after the
  /// round.
  std::vector<Chosen> chooseWorstOfAll(bool& isDue) {
    const std::size_t deferredBefore = state_.deferred.size();
    const std::vector<Chosen> own = chooseWorst();
    MessageWriter writer;
    writer.flag(shares()->isFirst() && refiner_.observer.isDue && refiner_.observer.isDue());
    writer.item(fitter_.evaluations() - refiner_.aheadOfTurn);
    for (const Chosen& chosen : own) writer.item(chosen.leaf);
    const std::vector<Message> messages = shares()->gatherAll(writer.take(), [&] { tryAhead(); });

    std::vector<Chosen> all;
    evaluations_ = 0;
    for (int rank = 0; rank < shares()->count(); ++rank) {
      MessageReader reader(messages[std::size_t(rank)]);
      bool flag = false;
      reader.flag(flag);
      isDue = isDue || flag;
      std::uint64_t evaluations = 0;
      reader.item(evaluations);
      evaluations_ += evaluations;
      for (std::size_t i = 0; !reader.isAtEnd(); ++i) {
        Chosen& chosen = all.emplace_back();
        reader.item(chosen.leaf);
        chosen.rank = rank;
        if (rank == ownRank()) chosen.node = own.at(i).node;
      }
    }
    std::ranges::sort(all, [](const Chosen& a, const Chosen& b) { return a.leaf < b.leaf; });
    if (all.size() < kRound) return all;

    // One process alone would not have looked at the leaves behind the last of the round.
    const LeafRank last = all[kRound - 1].leaf;
    for (std::size_t i = kRound; i < all.size(); ++i)
      if (all[i].rank == ownRank()) queue_.push(all[i].node);
    all.resize(kRound);
    std::vector<std::uint32_t>& deferred = state_.deferred;
    for (std::size_t i = deferred.size(); i-- > deferredBefore;) {
      if (!(last < queue_.rankOf(deferred[i]))) continue;
      queue_.push(deferred[i]);
      deferred.erase(deferred.begin() + std::ptrdiff_t(i));
    }
    return all;
  }

  /// Tells all processes the errors of the refinements of the chosen leaves, and returns those of all of them.
  std::vector<StepErrors> shareErrors(const std::vector<Chosen>& worst) {
    MessageWriter writer;
    for (const Chosen& chosen : worst) {
      if (chosen.rank != ownRank()) continue;
      const Trial& trial = queue_.trial(chosen.node);
      StepErrors errors = refiner_.errorsOf(chosen.node, trial, refiner_.raises(state_.tree.nodes[chosen.node], trial));
      errorItems(writer, errors);
    }
    const std::vector<Message> messages = shares()->gatherAll(writer.take(), [&] { tryAhead(); });
    std::vector<MessageReader> readers(messages.begin(), messages.end());
    std::vector<StepErrors> all(worst.size());
    for (std::size_t w = 0; w < worst.size(); ++w) errorItems(readers[std::size_t(worst[w].rank)], all[w]);
    return all;
  }

  /// Tries the refinements of the chosen leaves of this process that were not tried ahead.
  void tryMissing(const std::vector<Chosen>& worst) {
    std::vector<std::uint32_t> missing;
    for (const Chosen& chosen : worst) {
      if (chosen.rank != ownRank()) continue;
      if (queue_.hasTrial(chosen.node))
        refiner_.aheadOfTurn -= queue_.trial(chosen.node).evaluations;
      else
        missing.push_back(chosen.node);
    }
    std::vector<Trial> trials = tryAll(missing);
    for (std::size_t i = 0; i < missing.size(); ++i) queue_.keepTrial(missing[i], std::move(trials[i]));
  }

  /// Tries a few leaves whose turn has not come, unless there are too many such trials.
  void tryAhead() {
    setup_.progress.throwIfCancelled();
    constexpr std::size_t kMostAhead = 1024;
    const auto threads = std::size_t(tbb::this_task_arena::max_concurrency());
    std::vector<std::uint32_t> leaves;
    while (leaves.size() < threads) {
      const std::optional<std::uint32_t> leaf = queue_.firstUntried(kMostAhead);
      if (!leaf) break;
      leaves.push_back(*leaf);
      queue_.keepTrial(*leaf, {});  // so that the next one is another leaf
    }
    std::vector<Trial> trials = tryAll(leaves);
    for (std::size_t i = 0; i < leaves.size(); ++i) {
      refiner_.aheadOfTurn += trials[i].evaluations;
      queue_.keepTrial(leaves[i], std::move(trials[i]));
    }
  }

  /// Divides the leaves among the processes anew, so that each has about the same work left, whenever the number of
  /// steps has grown by half.
  void divideWhenDue() {
    constexpr double kGrowthBetween = 1.5, kMostUneven = 1.03;
    constexpr std::uint64_t kFirst = 32;
    if (shares() == nullptr || state_.stage != Stage::refine || state_.steps < nextDivision_) return;
    nextDivision_ = std::max(kFirst, std::uint64_t(kGrowthBetween * double(state_.steps)));
    // The refinements that a leaf still needs grow about with the root of its error.
    const auto work = [&](const BuildNode& node) {
      return refiner_.allowed(node) ? std::sqrt(node.fit.error.weighted) : 0;
    };
    const std::vector<double> weights = shares()->weights(state_.tree, work);
    const double share = std::accumulate(weights.begin(), weights.end(), 0.0) / double(weights.size());
    if (*std::ranges::max_element(weights) <= kMostUneven * share) return;
    std::map<LeafRank, Trial> tried = queue_.takeAll();
    shares()->divide({state_.tree, state_.deferred}, setup_.options.maxDepth, work, weights);
    enqueueLeaves();
    for (std::uint32_t n = 0; n < state_.tree.nodes.size(); ++n) {
      const auto found = state_.tree.nodes[n].firstChild == 0 ? tried.find(queue_.rankOf(n)) : tried.end();
      if (found == tried.end()) continue;
      queue_.keepTrial(n, std::move(found->second));
      tried.erase(found);
    }
    for (const auto& [leaf, trial] : tried) {  // other processes have these leaves now
      refiner_.aheadOfTurn -= trial.evaluations;
      fitter_.takeBack(trial.evaluations);
    }
    refiner_.countAll();
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

  void refine(std::uint32_t leaf) {
    Trial trial = queue_.takeTrial(leaf);
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
    if (!setup_.goal.byDistance()) return false;
    const ErrorTotals totals = state_.totals.rounded();
    return cell.near ? goal.nearReached(totals) : goal.farReached(totals);
  }

  /// Puts leaves that were set aside back into the queue: near leaves if the near error no longer meets its goal, and
  /// far leaves if the far error no longer meets its goal. Returns false if the queues of all processes stay empty.
  bool enqueueDeferred() {
    for (const std::uint32_t leaf : std::exchange(state_.deferred, {})) {
      if (isExactEnough(state_.tree.nodes[leaf].fit.error))
        state_.deferred.push_back(leaf);
      else
        enqueue(leaf);
    }
    const bool hasOwn = !queue_.isEmpty();
    return shares() != nullptr ? shares()->sum(std::uint64_t{hasOwn}) > 0 : hasOwn;
  }

  void enqueue(std::uint32_t leaf) {
    const BuildNode& node = state_.tree.nodes[leaf];
    if (node.fit.error.weighted > 0 && refiner_.allowed(node)) queue_.push(leaf);
  }

  /// Returns one of the factors of `GrowthProgress`, or 1 if the construction does not end at a weighted error.
  double growthFactor(double (GrowthProgress::*factor)(double, double, double) const) const {
    const ErrorGoal& goal = setup_.growthGoal;
    const bool endsOtherwise = goal.byDistance() || setup_.options.maxSteps || setup_.options.maxBytes;
    if (endsOtherwise || !(goal.weighted > 0)) return 1;
    return (progress_.*factor)(double(evaluations_), state_.totals.rounded().weighted, goal.weighted);
  }

  double fractionDone() {
    const ErrorGoal& goal = setup_.growthGoal;
    const ErrorTotals totals = state_.totals.rounded();
    double fraction = 0;
    if (goal.byDistance()) {
      const double near = totals.nearSquared / (goal.nearSquare * totals.nearVolume);
      const double far = totals.farSquared / (goal.farSquare * totals.farVolume);
      fraction = progress_.update(double(evaluations_), std::fmax(near, far), 1);
    } else if (goal.weighted > 0) {
      fraction = progress_.update(double(evaluations_), totals.weighted, goal.weighted);
    }
    if (setup_.options.maxSteps) fraction = std::max(fraction, double(state_.steps) / double(*setup_.options.maxSteps));
    return std::max(fraction, refiner_.bytes() / setup_.budget.growthLimit(state_.exactSize.inField));
  }

  const ConstructionSetup& setup_;
  const CellFitter& fitter_;
  ConstructionState& state_;
  Refiner& refiner_;
  LeafQueue queue_;
  std::uint64_t nextDivision_ = 0;  ///< number of steps after which the leaves are divided anew
  std::uint64_t evaluations_ = 0;   ///< of the exact distance, by all processes, except for leaves ahead of their turn
  GrowthProgress progress_;
};

}  // namespace

void growByErrors(Refiner& refiner) { Growth(refiner).run(); }

}  // namespace hpsdf::detail
