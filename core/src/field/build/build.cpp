#include "hpsdf/build.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <queue>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "field/build/build_tree.h"
#include "field/build/cell_bounds.h"
#include "field/build/cell_fit.h"
#include "field/build/checkpoint_file.h"
#include "field/build/limits.h"
#include "field/build/prune.h"
#include "field/build/worst_error.h"
#include "field/continuity/weak_continuity.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"

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

  /// How many times the work so far there will be in all, at least: as if the error fell from now on exponentially, no
  /// slower than it does at present. 1 until it has fallen by a decade, before which there is little to read.
  double leastGrowth(double work, double error, double target) const {
    if (history_.empty() || !(history_.front().error > 10 * error) || !(error > target)) return 1;
    const Point* back = &history_.front();
    for (const Point& point : history_)
      if (point.error > 3 * error) back = &point;
    if (!(work > back->work)) return 1;
    return 1 + std::log(error / target) * std::log(work / back->work) / std::log(back->error / error);
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
      : distance_(distance),
        options_(options),
        progress_(progress),
        length_(referenceLength(distance.source(), domain)),
        goal_(errorGoal(options, length_)),
        nearness_{options.nearnessKind, options.nearness, domain.diagonal().norm()},
        fitter_(distance, options, nearness_, options.nearDistance > 0 ? options.nearDistance : 0.01 * length_,
                progress) {
    tree_.domain = domain;
    tree_.grid = options.grid;
    requireRoom(0, 0);  // for Φ
  }

  /// Keeps its state there from now on, and goes on from the one that is there already, if any: whether there was.
  bool resume(CheckpointFile& checkpoint) {
    checkpoint_ = &checkpoint;
    std::optional<CheckedReader> reader = checkpoint.open();
    if (reader) takeUp(*reader);
    return reader.has_value();
  }

  std::uint64_t steps() const { return steps_; }

  /// `afterStep` is called once the base cells are there, with 0, and after each step with their number.
  void grow(const std::function<void(std::uint64_t)>& afterStep = {}) {
    if (stage_ == Stage::baseCells) fitBaseCells();
    if (afterStep) afterStep(steps_);
    if (stage_ == Stage::refining && growsByErrors()) refineWorstCells(afterStep);
    if (options_.maxError > 0) refineToMaxError(afterStep);
  }

  /// The field as it is now. The first takes a copy of the tree, the other the tree itself.
  FieldData frozen(const Source& source) { return finished(BuildTree(tree_), source); }
  FieldData finish(const Source& source) { return finished(std::move(tree_), source); }

 private:
  /// The tree as a field: first its cells become final, then its coefficients, then what is said about them.
  FieldData finished(BuildTree&& tree, const Source& source) {
    const std::uint64_t before = fitter_.evaluations();
    if (options_.criterion == Criterion::optimal) prune(tree, nearness_, pruneLimits());
    if (options_.enrich) enrich(tree);
    FieldMetadata known = metadata(source, sumOfErrors(tree));
    FieldData field = layOut(std::move(tree), std::move(known));
    // each goes by what the one before has left: jumps are closed in double, and bounds are those of the very
    // coefficients that are kept, blended as they will be
    if (options_.continuityWeight) makeWeaklyContinuous(field, {.weight = *options_.continuityWeight}, progress_);
    keepAs(coefficientType(), field);
    field.blend = options_.blend;
    if (options_.bounds) field.metadata.exactEvaluations += findBounds(field, distance_, progress_);
    ofFinishing_ += fitter_.evaluations() - before;
    return field;
  }

  /// Float where bytes are short.
  CoefficientType coefficientType() const {
    const bool chosenByBytes = options_.maxBytes && options_.coefficients == CoefficientType::automatic;
    return chosenByBytes ? CoefficientType::float32 : options_.coefficients;
  }

  PruneLimits pruneLimits() const {
    PruneLimits limits{.goal = goal_, .nodeBytes = nodeBytes()};
    for (int degree = 0; degree <= kMaxDegree; ++degree) limits.leafBytes[degree] = leafBytes(degree);
    // what ended early, but not for want of room, has refinements to take back all the same
    if (!growthGoal_.reached(totals_) && !full_) limits.goal = goal_.relaxedTo(totals_, 1 / kGrowth);
    if (options_.maxBytes) limits.mostBytes = treeBytes(*options_.maxBytes);
    limits.leastDegree = leastDegree();
    limits.mostDegree = options_.strategy == Strategy::hp ? options_.maxDegree : startDegree(options_);
    return limits;
  }

  /// The lowest to which the optimal criterion may take a leaf back.
  int leastDegree() const { return options_.strategy == Strategy::hp ? 1 : startDegree(options_); }

  int raisedDegree(int degree) const { return std::max(degree, std::min(degree + 1, options_.maxDegree)); }

  /// Every leaf one degree higher, all of its coefficients from samples of its own.
  void enrich(BuildTree& tree) const {
    const auto raised = [&](const BuildNode& node) { return raisedDegree(node.fit.degree); };
    std::size_t coefficients = 0;
    for (const BuildNode& node : tree.nodes)
      if (node.firstChild == 0) coefficients += coefficientCount(raised(node));
    requireRoom(tree.nodes.size(), coefficients);
    for (std::size_t begin = 0; begin < tree.nodes.size(); begin += kChunk) {
      progress_.at("raising every degree", double(begin) / double(tree.nodes.size()));
      tbb::parallel_for(begin, std::min(begin + kChunk, tree.nodes.size()), [&](std::size_t n) {
        BuildNode& node = tree.nodes[n];
        if (node.firstChild != 0 || node.fit.degree >= raised(node)) return;
        node.fit = fitter_.fit(tree.boxOf(node), raised(node));
        node.fit.spare = {};
      });
    }
  }

  FieldMetadata metadata(const Source& source, const ErrorTotals& totals) const {
    FieldMetadata metadata;
    metadata.source = source;
    const double scale = std::pow(length_ / 2, 5);
    metadata.targetError = goal_.byDistance() ? totals.weighted / scale : options_.targetError;
    metadata.totalError = totals.weighted / scale;
    metadata.referenceLength = length_;
    metadata.nearness = nearness_.exponent;
    metadata.nearnessKind = nearness_.kind;
    metadata.estimator = options_.estimator;
    metadata.criterion = options_.criterion;
    metadata.maxError = options_.maxError;
    metadata.measuredError = measuredError_;
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
  // How far beyond its goal a construction goes that then takes back what saved least. Bunny at τ=1e-6: 0.7 takes 1.3
  // times the distances for 0.49 times the coefficients, 0.5 takes 1.7 times for 0.48.
  static constexpr double kGrowth = 0.7;
  static constexpr std::size_t kLookRound = 256;
  static constexpr double kByteGrowth = 1.6;  // the same in bytes

  /// Of those whose state is kept: what is to be done next. All before is done.
  enum class Stage : std::uint8_t { baseCells, refining, looking };

  /// What is kept beside the tree, for both directions. The rest follows from it: see `takeUp`.
  template <typename Stream>
  void numberItems(Stream& stream, std::uint64_t& evaluations) {
    stream.item(stage_);
    stream.item(fitted_);
    stream.item(steps_);
    stream.item(evaluations);
    stream.item(nearness_.kind);
    stream.item(nearness_.exponent);
    for (double* number : {&totals_.weighted, &totals_.nearSquared, &totals_.nearVolume, &totals_.farSquared,
                           &totals_.farVolume, &lastSum_, &measuredError_})
      stream.item(*number);
    stream.flag(full_);
    stream.item(passed_);
  }

  void keepState() {
    if (checkpoint_ == nullptr || !checkpoint_->isDue()) return;
    checkpoint_->keep([&](CheckedWriter& writer) {
      std::uint64_t evaluations = fitter_.evaluations();
      numberItems(writer, evaluations);
      treeItems(writer, tree_);
      listItems(writer, aside_);
      listItems(writer, waiting_);
    });
  }

  void takeUp(CheckedReader& reader) {
    std::uint64_t evaluations = 0;
    numberItems(reader, evaluations);
    if (stage_ > Stage::looking || nearness_.kind > NearnessKind::exponential)
      reader.damaged("it is at an unknown stage");
    treeItems(reader, tree_, fitted_, options_);
    listItems(reader, aside_);
    listItems(reader, waiting_);
    reader.finish();
    if ((fitted_ < tree_.baseCells() && stage_ != Stage::baseCells) || passed_ > waiting_.size())
      reader.damaged("its numbers do not belong together");
    const std::vector<bool> isAside = leavesAmong(reader, aside_);
    leavesAmong(reader, std::span(waiting_).subspan(passed_));
    fitter_.setEvaluations(evaluations);
    if (stage_ == Stage::baseCells) return;
    for (std::uint32_t n = 0; n < tree_.nodes.size(); ++n) {
      if (tree_.nodes[n].firstChild != 0) continue;
      coefficients_ += keptCoefficients(tree_.nodes[n].fit.degree);
      if (stage_ == Stage::refining && !isAside[n]) enqueue(n);
    }
  }

  /// By node: whether it is one of these, which must be leaves, each named once.
  std::vector<bool> leavesAmong(const CheckedReader& reader, std::span<const std::uint32_t> nodes) const {
    std::vector<bool> among(tree_.nodes.size());
    for (const std::uint32_t n : nodes) {
      if (n >= among.size() || among[n] || tree_.nodes[n].firstChild != 0)
        reader.damaged("it names a cell that is none");
      among[n] = true;
    }
    return among;
  }

  void fitBaseCells() {
    const std::size_t count = tree_.baseCells();
    if (tree_.nodes.empty()) tree_.addBaseCells();
    const int degree = startDegree(options_);
    while (fitted_ < count) {
      progress_.at("fitting base cells", double(fitted_) / double(count));
      const std::size_t end = std::min<std::size_t>(fitted_ + kChunk, count);
      tbb::parallel_for(std::size_t(fitted_), end,
                        [&](std::size_t n) { tree_.nodes[n].fit = fitter_.fit(tree_.boxOf(tree_.nodes[n]), degree); });
      fitted_ = end;
      keepState();
    }
    coefficients_ = count * keptCoefficients(degree);
    if (goal_.byDistance()) chooseNearness();
    sumTotals();
    checkBaseGridsBytes();
    for (std::size_t n = 0; n < count; ++n) enqueue(static_cast<std::uint32_t>(n));
    stage_ = Stage::refining;
  }

  void checkBaseGridsBytes() const {
    if (!options_.maxBytes) return;
    double least = 0;  // that can come of the base cells
    for (const BuildNode& node : tree_.nodes) {
      const bool mayLower = options_.criterion == Criterion::optimal && !node.fit.outsideBand;
      least += leafBytes(mayLower ? leastDegree() : node.fit.degree);
    }
    if (least > treeBytes(*options_.maxBytes) || bytes() > mostBytesOfGrowth())
      throw Error("the base grid alone takes more than " + std::to_string(*options_.maxBytes) +
                  " bytes: allow more, or take a coarser grid");
  }

  /// θ, such that a cell at the mean distance of those far away weighs as much less as its error may be greater.
  void chooseNearness() {
    double distance = 0, volume = 0;
    for (const BuildNode& node : tree_.nodes) {
      if (node.fit.error.near) continue;
      distance += node.fit.error.volume * std::abs(node.fit.coefficients[0]);
      volume += node.fit.error.volume;
    }
    nearness_.kind = NearnessKind::exponential;
    nearness_.exponent = 0;
    if (distance > 0)
      nearness_.exponent = std::log(goal_.farSquare / goal_.nearSquare) * nearness_.diagonal * volume / distance;
    for (BuildNode& node : tree_.nodes)
      node.fit.error.weighted = nearness_.weight(node.fit.coefficients[0]) * node.fit.error.squared;
  }

  /// Whether errors of cells decide what is refined, rather than a maximum error alone: by bytes alone they would leave
  /// it no room.
  bool growsByErrors() const { return options_.targetError > 0 || goal_.byDistance() || !(options_.maxError > 0); }

  void refineWorstCells(const std::function<void(std::uint64_t)>& afterStep) {
    while (!reached() && mayStep() && (!queue_.empty() || takeUpAside())) {
      refineRound(afterStep);
      // rounding in the running total must end the construction neither early nor never
      if (reached() || totals_.weighted < 1e-6 * lastSum_) sumTotals();
      keepState();
    }
  }

  bool reached() const { return growthGoal_.reached(totals_); }

  /// Whether its kind of cells, near or far, is exact enough already.
  bool isDone(const CellError& cell) const {
    return goal_.byDistance() && (cell.near ? growthGoal_.nearReached(totals_) : growthGoal_.farReached(totals_));
  }

  /// Back into the queue with the cells that were put aside and are not exact enough after all.
  bool takeUpAside() {
    std::vector<std::uint32_t> aside = std::exchange(aside_, {});
    for (const std::uint32_t node : aside) {
      if (isDone(tree_.nodes[node].fit.error))
        aside_.push_back(node);
      else
        enqueue(node);
    }
    return !queue_.empty();
  }

  /// Spare ones and those of internal nodes are some three times those of the leaves.
  std::size_t coefficientsInMemory() const {
    return options_.criterion == Criterion::optimal ? 4 * coefficients_ : coefficients_;
  }

  void requireRoom(std::size_t nodes, std::size_t coefficients, double times = 1) const {
    checkFitsMemory({nodes, coefficients, times, distance_.bytes()}, options_);
  }

  /// Of the field as it will be, but for its lookup grid.
  double bytes() const {
    return nodeBytes() * double(tree_.nodes.size()) + coefficientBytes(options_) * double(coefficients_);
  }
  /// Of its node, its reach where leaves are blended, its bound.
  double nodeBytes() const {
    return 8 + (options_.blend > 0 ? 4 : 0) + (options_.bounds ? double(sizeof(CellBound)) : 0);
  }
  /// As many as the field will keep of a cell of this degree.
  std::size_t keptCoefficients(int degree) const {
    return std::size_t(coefficientCount(options_.enrich ? raisedDegree(degree) : degree));
  }
  double leafBytes(int degree) const {
    return nodeBytes() + coefficientBytes(options_) * double(keptCoefficients(degree));
  }
  /// Without the lookup grid, which takes an entry for each base cell or, if that is more, a sixteenth of nodes and
  /// coefficients at most, and half as much again for reaches.
  double treeBytes(std::uint64_t ofField) const {
    const double ofEntries = options_.blend > 0 ? 1.5 : 1, baseEntries = 8.0 * double(tree_.baseCells());
    return std::min(double(ofField) / (1 + ofEntries / 16), double(ofField) - ofEntries * baseEntries);
  }
  double mostBytesOfGrowth() const {
    if (!options_.maxBytes) return HUGE_VAL;
    return treeBytes(*options_.maxBytes) * (options_.criterion == Criterion::optimal ? kByteGrowth : 1);
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
    if (leaf.fit.error.weighted > 0 && allowed(leaf)) queue_.push({leaf.fit.error.weighted, node});
  }

  bool mayStep() const { return !full_ && (!options_.maxSteps || steps_ < *options_.maxSteps); }

  double leastGrowth() const {
    if (goal_.byDistance() || options_.maxSteps || options_.maxBytes || !(growthGoal_.weighted > 0)) return 1;
    return estimate_.leastGrowth(double(fitter_.evaluations()), totals_.weighted, growthGoal_.weighted);
  }

  double fractionDone() {
    double fraction = 0;
    if (goal_.byDistance()) {
      const double near = totals_.nearSquared / (growthGoal_.nearSquare * totals_.nearVolume);
      const double far = totals_.farSquared / (growthGoal_.farSquare * totals_.farVolume);
      fraction = estimate_.update(double(fitter_.evaluations()), std::fmax(near, far), 1);
    } else if (growthGoal_.weighted > 0) {
      fraction = estimate_.update(double(fitter_.evaluations()), totals_.weighted, growthGoal_.weighted);
    }
    if (options_.maxSteps) fraction = std::max(fraction, double(steps_) / double(*options_.maxSteps));
    return options_.maxBytes ? std::max(fraction, bytes() / mostBytesOfGrowth()) : fraction;
  }

  void refineRound(const std::function<void(std::uint64_t)>& afterStep) {
    progress_.at("refining", fractionDone());
    requireRoom(tree_.nodes.size(), coefficientsInMemory(), leastGrowth());
    std::vector<std::uint32_t> worst;
    while (worst.size() < kRound && !queue_.empty()) {
      const std::uint32_t next = queue_.top().node;
      queue_.pop();
      (isDone(tree_.nodes[next].fit.error) ? aside_ : worst).push_back(next);
    }
    std::vector<Trial> trials = tryAll(worst);
    for (std::size_t w = 0; w < worst.size(); ++w) {
      if (reached() || !mayStep()) {  // done, unless an exact sum says otherwise
        enqueue(worst[w]);
        continue;
      }
      refine(worst[w], std::move(trials[w]), afterStep);
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

  void refine(std::uint32_t node, Trial&& trial, const std::function<void(std::uint64_t)>& afterStep) {
    const bool raises = allowed(tree_.nodes[node]) != Refinement::octree && trial.raised &&
                        (!trial.children || prefersDegree(tree_.nodes[node].fit, trial));
    take(node, std::move(trial), raises, afterStep);
  }

  /// One of the two refinements of a leaf, unless there is no room for it.
  void take(std::uint32_t node, Trial&& trial, bool raises, const std::function<void(std::uint64_t)>& afterStep) {
    if (tree_.nodes.size() > 0xffffffffu - 8)
      throw Error("the field needs more than 2^32 cells; raise the target error or lower the maximum depth");
    const std::size_t before = keptCoefficients(tree_.nodes[node].fit.degree);
    const std::size_t added = raises ? keptCoefficients(trial.raised->degree) - before : 7 * before;
    if (bytes() + coefficientBytes(options_) * double(added) + (raises ? 0 : 8 * nodeBytes()) > mostBytesOfGrowth()) {
      full_ = true;
      return;
    }
    coefficients_ += added;
    totals_.add(tree_.nodes[node].fit.error, -1);
    if (raises) {
      tree_.nodes[node].fit = std::move(*trial.raised);
      totals_.add(tree_.nodes[node].fit.error);
      enqueue(node);
    } else {
      const bool keepsOwn = options_.criterion == Criterion::optimal;
      tree_.split(node, std::move(*trial.children), keepsOwn ? std::move(*trial.raised) : Fit{});
      const std::uint32_t first = tree_.nodes[node].firstChild;
      for (std::uint32_t child = first; child < first + 8; ++child) {
        totals_.add(tree_.nodes[child].fit.error);
        enqueue(child);
      }
    }
    if (++steps_ % kResum == 0) sumTotals();
    if (afterStep) afterStep(steps_);
  }

  /// The hp decision (paper, eqs. 7 to 9), every error weighted by nearness.
  static bool prefersDegree(const Fit& current, const Trial& trial) {
    double worstChild = 0;
    for (const Fit& child : *trial.children) worstChild = std::max(worstChild, child.error.weighted);
    const int p = current.degree;
    const double error = current.error.weighted;
    const double mu = (error - 8 * trial.raised->error.weighted) / (coefficientCount(p + 1) - coefficientCount(p));
    const double nu = (error - 8 * worstChild) / (7 * coefficientCount(p));
    return mu > nu;
  }

  /// What `refineToMaxError` finds out about a leaf.
  struct Looked {
    double worst = 0;  ///< |f − Φ|, see `worstError`
    std::optional<Trial> trial;
    bool raises = false;
  };

  void refineToMaxError(const std::function<void(std::uint64_t)>& afterStep) {
    if (stage_ != Stage::looking) {
      for (std::uint32_t n = 0; n < tree_.nodes.size(); ++n)
        if (tree_.nodes[n].firstChild == 0) waiting_.push_back(n);
      stage_ = Stage::looking;
    }
    while (passed_ < waiting_.size()) {
      requireRoom(tree_.nodes.size(), coefficientsInMemory());
      progress_.at("looking for the maximum error", double(passed_) / double(waiting_.size()));
      const std::size_t count = std::min<std::size_t>(kLookRound, waiting_.size() - passed_);
      std::vector<Looked> looked(count);
      tbb::parallel_for(std::size_t{0}, count,
                        [&](std::size_t i) { looked[i] = look(tree_.nodes[waiting_[passed_ + i]]); });
      for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t node = waiting_[passed_ + i];
        if (!looked[i].trial) {
          measuredError_ = std::max(measuredError_, looked[i].worst);
          continue;
        }
        if (!mayStep()) {
          waiting_.push_back(node);  // to be measured as it is
          continue;
        }
        const std::size_t before = tree_.nodes.size();
        take(node, std::move(*looked[i].trial), looked[i].raises, afterStep);
        if (full_ || looked[i].raises) {
          waiting_.push_back(node);
        } else {
          for (std::size_t child = before; child < before + 8; ++child)
            waiting_.push_back(static_cast<std::uint32_t>(child));
        }
      }
      passed_ += count;
      keepState();
    }
    sumTotals();
  }

  /// The leaf at many places; where one is too bad, a trial of its refinements. The degree is raised where that is
  /// enough, else as the paper's criterion says.
  Looked look(const BuildNode& leaf) const {
    Looked looked;
    if (leaf.fit.outsideBand) return looked;
    const Box box = tree_.boxOf(leaf);
    const std::optional<Refinement> may = mayStep() ? allowed(leaf) : std::nullopt;
    const double most = options_.maxError;
    const bool surelyBad = leaf.fit.error.squared > most * most / 4 * leaf.fit.error.volume;  // RMS: spares the look
    if (may && surelyBad) {
      looked.trial = fitter_.attempt(box, leaf.fit, *may);
      looked.raises = looked.trial->raised && (!looked.trial->children || prefersDegree(leaf.fit, *looked.trial));
      return looked;
    }
    const std::vector<double> exact = fitter_.distances(box, lookedAt());
    // a place outside of the band speaks for its surroundings within
    const double farthest =
        options_.band > 0 ? options_.band + lookSpacing(box.sizes().norm()) : std::numeric_limits<double>::infinity();
    looked.worst = worstError(leaf.fit, exact, farthest);
    if (looked.worst <= most || !may) return looked;
    looked.trial = fitter_.attempt(box, leaf.fit, *may);
    looked.raises = looked.trial->raised &&
                    (!looked.trial->children || worstError(*looked.trial->raised, exact, farthest) <= most ||
                     prefersDegree(leaf.fit, *looked.trial));
    return looked;
  }

  static ErrorTotals sumOfErrors(const BuildTree& tree) {
    ErrorTotals sum;
    for (const BuildNode& node : tree.nodes)
      if (node.firstChild == 0) sum.add(node.fit.error);
    return sum;
  }

  void sumTotals() {
    totals_ = sumOfErrors(tree_);
    lastSum_ = totals_.weighted;
  }

  const DistanceFunction& distance_;
  const BuildOptions& options_;
  const Progress& progress_;
  double length_;
  ErrorGoal goal_;
  ErrorGoal growthGoal_ = options_.criterion == Criterion::optimal ? goal_.times(kGrowth) : goal_;
  Nearness nearness_;
  CellFitter fitter_;
  BuildTree tree_;
  Stage stage_ = Stage::baseCells;
  std::uint64_t fitted_ = 0;  ///< base cells that have a fit
  std::priority_queue<Entry> queue_;
  std::vector<std::uint32_t> aside_;    ///< leaves whose kind was exact enough when their turn came
  ErrorTotals totals_;                  ///< kept up step by step
  double lastSum_ = 0;                  ///< their weighted error when they were last summed anew
  std::vector<std::uint32_t> waiting_;  ///< for `refineToMaxError`, in the order of their turns
  std::uint64_t passed_ = 0;            ///< of these, done with
  double measuredError_ = 0;            ///< greatest that `refineToMaxError` has left
  bool full_ = false;                   ///< no more bytes may be taken
  std::size_t coefficients_ = 0;        ///< that the field will keep of all leaves
  std::uint64_t steps_ = 0;
  std::uint64_t ofFinishing_ = 0;  ///< calls of Φ for fields that were handed out on the way
  ProgressEstimate estimate_;
  CheckpointFile* checkpoint_ = nullptr;
};

}  // namespace

void checkBuild(const Box& domain, const BuildOptions& options) { checkOptions(domain, options); }

Field build(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
            const Progress& progress) {
  checkOptions(domain, options);
  return Field(withThreads(options.threads, [&] {
    Construction construction(distance, domain, options, progress);
    construction.grow();
    return construction.finish(distance.source());
  }));
}

Field buildResumably(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                     const Checkpoint& checkpoint, const Progress& progress) {
  checkOptions(domain, options);
  return Field(withThreads(options.threads, [&] {
    CheckpointFile file(checkpoint, distance, domain, options);
    Construction construction(distance, domain, options, progress);
    if (construction.resume(file) && checkpoint.resumed) checkpoint.resumed(construction.steps());
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
  checkOptions(domain, limited);
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
