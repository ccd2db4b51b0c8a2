#include "hpsdf/build.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <numeric>
#include <queue>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "field/build_options.h"
#include "field/build_tree.h"
#include "field/cell_fit.h"
#include "field/weak_continuity.h"
#include "hpsdf/error.h"
#include "threads.h"

namespace hpsdf {
namespace {

/// Estimates the fraction done from how fast the error has fallen for the work spent lately: error and work follow a
/// power law, whose exponent is read off the last decade.
class ProgressEstimate {
 public:
  double update(double work, double error, double target) {
    if (error <= target) return 1;
    if (history_.empty() || error < 0.8 * history_.back().error) history_.push_back({work, error});
    const Point* back = &history_.front();
    for (const Point& point : history_)
      if (point.error > 10 * error) back = &point;
    double exponent = 0.7;  // typical of scanned meshes, until there is something to read
    if (back->error > 2 * error && work > back->work)
      exponent = std::log(work / back->work) / std::log(back->error / error);
    fraction_ = std::max(fraction_, std::min(0.99, std::pow(target / error, exponent)));
    return fraction_;
  }

 private:
  struct Point {
    double work, error;
  };
  std::vector<Point> history_;
  double fraction_ = 0;
};

/// Algorithm 1 of the paper, its queue served in rounds: the worst cells of a round are tried in parallel and then
/// refined one after another in the order of the queue, so that the result does not depend on the number of threads.
class Construction {
 public:
  Construction(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
               const Progress& progress)
      : options_(options),
        progress_(progress),
        length_(referenceLength(distance.source(), domain)),
        target_(scaledTarget(options, length_)),
        fitter_(distance, options, domain.diagonal().norm(), progress) {
    tree_.domain = domain;
    tree_.grid = options.grid;
  }

  /// `afterStep` is called once the base cells are there, with 0, and after each step with their number.
  void grow(const std::function<void(std::uint64_t)>& afterStep = {}) {
    fitBaseCells();
    if (afterStep) afterStep(steps_);
    while (!(totalError_ <= target_) && mayStep() && !queue_.empty()) {
      refineRound(afterStep);
      // rounding in the running total must end the construction neither early nor never
      if (totalError_ <= target_ || totalError_ < 1e-6 * lastSum_) sumTotalError();
    }
  }

  /// The field as it is now. The first takes a copy of the tree, the other the tree itself.
  FieldData frozen(const Source& source) { return finished(BuildTree(tree_), source); }
  FieldData finish(const Source& source) { return finished(std::move(tree_), source); }

 private:
  FieldData finished(BuildTree&& tree, const Source& source) {
    const std::uint64_t before = fitter_.evaluations();
    if (options_.enrich) enrich(tree);
    FieldMetadata known = metadata(source, sumOfErrors(tree));
    FieldData field = layOut(std::move(tree), std::move(known));
    if (options_.continuityWeight) makeWeaklyContinuous(field, {.weight = *options_.continuityWeight}, progress_);
    keepAs(options_.coefficients, field);
    ofFinishing_ += fitter_.evaluations() - before;
    return field;
  }

  int raisedDegree(int degree) const { return std::max(degree, std::min(degree + 1, options_.maxDegree)); }

  /// Every leaf one degree higher, all of its coefficients from samples of its own.
  void enrich(BuildTree& tree) const {
    const auto raised = [&](const BuildNode& node) { return raisedDegree(node.fit.degree); };
    std::size_t coefficients = 0;
    for (const BuildNode& node : tree.nodes)
      if (node.firstChild == 0) coefficients += coefficientCount(raised(node));
    checkFitsMemory(tree.nodes.size(), coefficients);
    for (std::size_t begin = 0; begin < tree.nodes.size(); begin += kChunk) {
      report("raising every degree", double(begin) / double(tree.nodes.size()));
      tbb::parallel_for(begin, std::min(begin + kChunk, tree.nodes.size()), [&](std::size_t n) {
        BuildNode& node = tree.nodes[n];
        if (node.firstChild == 0 && node.fit.degree < raised(node))
          node.fit = fitter_.fit(tree.boxOf(node), raised(node));
      });
    }
  }

  FieldMetadata metadata(const Source& source, double totalError) const {
    FieldMetadata metadata;
    metadata.source = source;
    metadata.targetError = options_.targetError;
    metadata.totalError = totalError / std::pow(length_ / 2, 5);
    metadata.referenceLength = length_;
    metadata.nearness = options_.nearness;
    metadata.maxDegree = options_.strategy == Strategy::hp ? options_.maxDegree
                         : options_.enrich                 ? raisedDegree(startDegree(options_))
                                                           : startDegree(options_);
    metadata.maxDepth = options_.maxDepth;
    metadata.quadrature = options_.quadrature;
    metadata.strategy = options_.strategy;
    metadata.band = options_.band;
    metadata.exactEvaluations = fitter_.evaluations() - ofFinishing_;
    metadata.steps = steps_;
    metadata.enriched = options_.enrich;
    return metadata;
  }

  struct Entry {
    double error;
    std::uint32_t node;
    bool operator<(const Entry& other) const {
      return error < other.error || (error == other.error && node > other.node);
    }
  };

  static constexpr std::size_t kRound = 32;    // few enough to stay close to the paper's order, one cell at a time
  static constexpr std::size_t kResum = 1000;  // steps between exact sums of the total error (paper, sec. 3.6)
  static constexpr std::size_t kChunk = 4096;

  void fitBaseCells() {
    const std::size_t count = std::size_t(options_.grid[0]) * options_.grid[1] * options_.grid[2];
    tree_.nodes.resize(count);
    for (std::size_t n = 0; n < count; ++n) {
      tree_.nodes[n].place = {static_cast<std::uint32_t>(n % options_.grid[0]),
                              static_cast<std::uint32_t>(n / options_.grid[0] % options_.grid[1]),
                              static_cast<std::uint32_t>(n / options_.grid[0] / options_.grid[1])};
    }
    const int degree = startDegree(options_);
    for (std::size_t begin = 0; begin < count; begin += kChunk) {
      report("fitting base cells", double(begin) / double(count));
      tbb::parallel_for(begin, std::min(begin + kChunk, count),
                        [&](std::size_t n) { tree_.nodes[n].fit = fitter_.fit(tree_.boxOf(tree_.nodes[n]), degree); });
    }
    coefficients_ = count * std::size_t(coefficientCount(degree));
    sumTotalError();
    for (std::size_t n = 0; n < count; ++n) enqueue(static_cast<std::uint32_t>(n));
  }

  /// What may be done to a leaf; nothing: empty.
  std::optional<Refinement> allowed(const BuildNode& node) const {
    const bool mayRaise = options_.strategy == Strategy::hp && node.fit.degree < options_.maxDegree;
    const bool maySplit = int(node.depth) < options_.maxDepth;
    if (mayRaise && maySplit) return Refinement::either;
    if (mayRaise) return Refinement::degree;
    if (maySplit) return Refinement::octree;
    return std::nullopt;
  }

  void enqueue(std::uint32_t node) {
    const BuildNode& leaf = tree_.nodes[node];
    if (leaf.fit.error > 0 && allowed(leaf)) queue_.push({leaf.fit.error, node});
  }

  bool mayStep() const { return !options_.maxSteps || steps_ < *options_.maxSteps; }

  double fractionDone() {
    const double ofError = estimate_.update(double(fitter_.evaluations()), totalError_, target_);
    return options_.maxSteps ? std::max(ofError, double(steps_) / double(*options_.maxSteps)) : ofError;
  }

  void refineRound(const std::function<void(std::uint64_t)>& afterStep) {
    checkFitsMemory(tree_.nodes.size(), coefficients_);
    report("refining", fractionDone());
    std::vector<std::uint32_t> worst;
    while (worst.size() < kRound && !queue_.empty()) {
      worst.push_back(queue_.top().node);
      queue_.pop();
    }
    std::vector<Trial> trials = tryAll(worst);
    for (std::size_t w = 0; w < worst.size(); ++w) {
      if (totalError_ <= target_ || !mayStep()) {  // done, unless an exact sum says otherwise
        enqueue(worst[w]);
        continue;
      }
      refine(worst[w], std::move(trials[w]));
      if (++steps_ % kResum == 0) sumTotalError();
      if (afterStep) afterStep(steps_);
    }
  }

  /// In parallel, the dearest first, so that no thread is left with a long one at the end while the others wait.
  std::vector<Trial> tryAll(const std::vector<std::uint32_t>& cells) const {
    std::vector<std::size_t> order(cells.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, std::greater(), [&](std::size_t w) { return tree_.nodes[cells[w]].fit.degree; });
    std::vector<Trial> trials(cells.size());
    std::atomic<std::size_t> next = 0;
    tbb::parallel_for(
        0, tbb::this_task_arena::max_concurrency(),
        [&](int) {
          for (std::size_t taken = next++; taken < order.size(); taken = next++) {
            const BuildNode& node = tree_.nodes[cells[order[taken]]];
            trials[order[taken]] = fitter_.attempt(tree_.boxOf(node), node.fit, *allowed(node));
          }
        },
        tbb::simple_partitioner{});
    return trials;
  }

  void refine(std::uint32_t node, Trial&& trial) {
    if (tree_.nodes.size() > 0xffffffffu - 8)
      throw Error("the field needs more than 2^32 cells; raise the target error or lower the maximum depth");
    totalError_ -= tree_.nodes[node].fit.error;
    const std::size_t before = tree_.nodes[node].fit.coefficients.size();
    if (trial.raised && (!trial.children || prefersDegree(tree_.nodes[node].fit, trial))) {
      tree_.nodes[node].fit = std::move(*trial.raised);
      totalError_ += tree_.nodes[node].fit.error;
      coefficients_ += tree_.nodes[node].fit.coefficients.size() - before;
      enqueue(node);
      return;
    }
    tree_.split(node, std::move(*trial.children));
    coefficients_ += 7 * before;
    const std::uint32_t first = tree_.nodes[node].firstChild;
    for (std::uint32_t child = first; child < first + 8; ++child) {
      totalError_ += tree_.nodes[child].fit.error;
      enqueue(child);
    }
  }

  /// The hp decision (paper, eqs. 7 to 9), every error weighted by nearness.
  static bool prefersDegree(const Fit& current, const Trial& trial) {
    double worstChild = 0;
    for (const Fit& child : *trial.children) worstChild = std::max(worstChild, child.error);
    const int p = current.degree;
    const double mu = (current.error - 8 * trial.raised->error) / (coefficientCount(p + 1) - coefficientCount(p));
    const double nu = (current.error - 8 * worstChild) / (7 * coefficientCount(p));
    return mu > nu;
  }

  static double sumOfErrors(const BuildTree& tree) {
    double sum = 0;
    for (const BuildNode& node : tree.nodes)
      if (node.firstChild == 0) sum += node.fit.error;
    return sum;
  }

  void sumTotalError() { totalError_ = lastSum_ = sumOfErrors(tree_); }

  void report(std::string_view task, double fraction) const {
    if (progress_.cancelled && progress_.cancelled()) throw Cancelled();
    if (progress_.report) progress_.report(task, fraction);
  }

  const BuildOptions& options_;
  const Progress& progress_;
  double length_;
  double target_;
  CellFitter fitter_;
  BuildTree tree_;
  std::priority_queue<Entry> queue_;
  double totalError_ = 0;         ///< kept up step by step
  double lastSum_ = 0;            ///< what it was when it was last summed anew
  std::size_t coefficients_ = 0;  ///< of all leaves
  std::uint64_t steps_ = 0;
  std::uint64_t ofFinishing_ = 0;  ///< calls of Φ for fields that were handed out on the way
  ProgressEstimate estimate_;
};

}  // namespace

Field build(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
            const Progress& progress) {
  checkBuild(domain, options);
  return Field(withThreads(options.threads, [&] {
    Construction construction(distance, domain, options, progress);
    construction.grow();
    return construction.finish(distance.source());
  }));
}

void buildStages(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                 std::span<const std::uint64_t> steps, const std::function<void(Field)>& visit,
                 const Progress& progress) {
  if (!std::ranges::is_sorted(steps)) throw Error("stages of a construction: expected steps that do not descend");
  if (steps.empty()) return;
  BuildOptions limited = options;
  limited.maxSteps = std::min(options.maxSteps.value_or(steps.back()), steps.back());
  checkBuild(domain, limited);
  withThreads(options.threads, [&] {
    Construction construction(distance, domain, limited, progress);
    std::size_t stage = 0;
    const auto visitNext = [&] {
      visit(Field(construction.frozen(distance.source())));
      ++stage;
    };
    construction.grow([&](std::uint64_t taken) {
      while (stage < steps.size() && steps[stage] == taken) visitNext();
    });
    while (stage < steps.size()) visitNext();  // more steps than there are
  });
}

}  // namespace hpsdf
