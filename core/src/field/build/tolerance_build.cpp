#include "field/build/tolerance_build.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "field/build/least_bytes.h"
#include "field/build/limits.h"
#include "field/cells/cell_bounds.h"
#include "field/precision/round_coefficients.h"
#include "hpsdf/detail/build_settings.h"

namespace hpsdf::detail {
namespace {

std::optional<ExactCells> exactCellsWithin(const DistanceFunction& distance, const BuildOptions& options,
                                           double length) {
  constexpr double kShareOfPlanes = 0.01;  // of the tolerance, for planes that stand for triangles
  if (!mayHaveExactLeaves(distance, length)) return std::nullopt;
  return ExactCells(*distance.triangleSearch(), 0, static_cast<std::size_t>(options.exactTriangles), options.blend,
                    kShareOfPlanes * options.tolerance);
}

std::uint32_t greatestDepth(const BuildOptions& options) {
  const auto across = std::uint64_t(*std::ranges::max_element(options.grid));
  std::uint32_t depth = 0;
  while (depth < std::uint32_t(kMaxDepth) && across << (depth + 1) <= std::uint64_t{1} << 32) ++depth;
  return depth;
}

using Clock = std::chrono::steady_clock;

/// One construction within a tolerance. The cells of the first few depths are looked at depth by depth. Those that are
/// divided further are the tasks of the construction. The first ones that are done are a sample of all of them, which
/// tells what all will take.
class ToleranceBuild {
 public:
  ToleranceBuild(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                 const Progress& progress)
      : distance_(distance),
        options_(options),
        progress_(progress),
        setup_(distance, domain, options, progress),
        tree_(setup_.tree),
        cells_(setup_.tree, setup_.fitter, setup_.exact, setup_.maxDepth, setup_.budget,
               [this](std::uint64_t cells) { requireRoom(double(cells), 0); }) {}

  FieldData run() {
    tree_.addBaseCells();
    roots_.resize(tree_.nodes.size());
    lookAtFirstDepths();
    doTasks();
    std::for_each(divided_.rbegin(), divided_.rend(), [this](CheapCell* cell) { cells_.settle(*cell); });
    double worst = 0;
    for (std::uint32_t n = 0; n < roots_.size(); ++n) worst = std::max(worst, moveToTree(n, std::move(roots_[n])));
    FieldData field = layOut(std::move(tree_), metadata(worst), distance_.triangleSearch());
    field.blend = options_.blend;
    roundCoefficients(options_.coefficients, field);
    if (options_.bounds) field.metadata.exactEvaluations += findBounds(field, distance_, progress_);
    return field;
  }

 private:
  /// A cell to be solved.
  struct Task {
    CheapCell* cell;
    CellPlace place;
    const CheapCell* parent = nullptr;  ///< nullptr for a cell of the base grid

    double ratioAbove() const { return parent ? parent->ratio : 0; }
    /// Orders tasks by the work that they are likely to take: first by whether a jump of the distance was found in the
    /// parent, then by the parent's error.
    std::pair<bool, double> error() const { return {parent && parent->jumps, ratioAbove()}; }
    /// Returns true if the task may take much longer than most others. Where the distance has a kink, the number of
    /// leaves grows as the square of the error, and where it jumps even more.
    bool isLarge() const {
      constexpr double kLargeError = 8;
      return error() > std::pair(false, kLargeError);
    }
    /// Returns the bytes of a cell that is done. The parent stays a leaf if its children take more.
    double bytes() const { return parent ? std::min(cell->bytes, parent->bytes / 8) : cell->bytes; }
  };

  /// Looks at all cells of the first depths, until enough cells are left for tasks. A few of these may take most of the
  /// work, usually those with the greatest errors: they are divided further, until none stands out or there are many.
  void lookAtFirstDepths() {
    constexpr std::size_t kEnough = 500, kMany = 8000, kPart = 10;
    for (std::uint32_t n = 0; n < roots_.size(); ++n) tasks_.push_back({&roots_[n], {0, tree_.nodes[n].cellIndex}});
    shuffle(tasks_);
    while (!tasks_.empty() && tasks_.size() < kEnough) tasks_ = childrenOf(tasks_);
    while (tasks_.size() >= kPart && tasks_.size() < kMany) {
      std::ranges::stable_sort(tasks_, {}, &Task::error);
      if (!tasks_.back().isLarge()) break;
      const std::vector<Task> greatest(tasks_.end() - std::ptrdiff_t(tasks_.size() / kPart), tasks_.end());
      tasks_.resize(tasks_.size() - greatest.size());
      std::ranges::copy(childrenOf(greatest), std::back_inserter(tasks_));
    }
    firstCells_ = cells_.cells();
  }

  /// Brings the cells of the base grid into a random order, always the same. In the order of the grid, a sample of
  /// every so many cells might be a plane of the grid.
  static void shuffle(std::vector<Task>& tasks) {
    std::mt19937_64 random;
    for (std::size_t t = tasks.size(); t > 1; --t) std::swap(tasks[t - 1], tasks[random() % t]);
  }

  /// Makes leaves of cells, and divides those whose children may take fewer bytes. Returns these children.
  std::vector<Task> childrenOf(const std::vector<Task>& looks) {
    progress_.update("fitting first cells", 0);
    std::vector<std::uint8_t> divides(looks.size());
    tbb::parallel_for(std::size_t{0}, looks.size(), [&](std::size_t n) {
      divides[n] = cells_.makeLeaf(*looks[n].cell, looks[n].place, looks[n].ratioAbove());
    });
    std::vector<Task> children;
    for (std::size_t n = 0; n < looks.size(); ++n) {
      CheapCell& cell = *looks[n].cell;
      firstBytes_ += divides[n] != 0 ? setup_.budget.nodeBytes() : cell.bytes;
      if (divides[n] == 0) continue;
      LeastBytes::divide(cell);
      divided_.push_back(&cell);
      for (std::uint32_t child = 0; child < 8; ++child)
        children.push_back({&(*cell.children)[child], looks[n].place.child(child), &cell});
    }
    return children;
  }

  void doTasks() {
    constexpr std::size_t kRounds = 60, kFewestAtOnce = 64;
    tasksBegan_ = Clock::now();
    const std::size_t sample = orderTasks(), atOnce = std::max(kFewestAtOnce, tasks_.size() / kRounds);
    for (std::size_t done = 0; done < tasks_.size();) {
      progress_.update("fitting cells", double(done) / double(tasks_.size()));
      const std::size_t end = std::min(done + atOnce, done < sample ? sample : tasks_.size());
      tbb::parallel_for(
          done, end, [&](std::size_t t) { cells_.solve(*tasks_[t].cell, tasks_[t].place, tasks_[t].ratioAbove()); },
          tbb::simple_partitioner{});
      done = end;
      forecast(done, sample);
    }
  }

  /// Puts the tasks into an order in which the first ones are a systematic sample: one of so many tasks of a list
  /// sorted by the errors of the parents. The others follow in as many passes through the list. Returns the size of the
  /// sample.
  std::size_t orderTasks() {
    constexpr std::size_t kUsualSample = 100, kMostPasses = 15;
    std::ranges::stable_sort(tasks_, {}, &Task::error);
    // The number of passes is odd, so that each meets all eight children of a cell evenly.
    const std::size_t passes = std::min(tasks_.size() / kUsualSample, kMostPasses) | 1;
    std::vector<Task> ordered;
    ordered.reserve(tasks_.size());
    std::size_t sample = 0;
    for (std::size_t pass = 0; pass < passes; ++pass) {
      for (std::size_t t = (pass + passes / 2) % passes; t < tasks_.size(); t += passes) ordered.push_back(tasks_[t]);
      if (pass == 0) sample = ordered.size();
    }
    tasks_ = std::move(ordered);
    return sample;
  }

  /// Estimates what the whole construction takes from the tasks that are done. Reports it once, and throws `Error` if
  /// it is more than the memory allows.
  void forecast(std::size_t done, std::size_t sample) {
    for (; summed_ < done; ++summed_) taskBytes_ += tasks_[summed_].bytes();
    const double scale = double(tasks_.size()) / double(done), bytes = taskBytes_ * scale;
    // Cells are in memory as they are built, and again as the arrays of the field are made.
    requireRoom(double(firstCells_) + double(cells_.cells() - firstCells_) * scale, 2 * bytes);
    if (hasForecast_ || done < sample) return;
    hasForecast_ = true;
    if (!progress_.forecast) return;
    const double firstSeconds = std::chrono::duration<double>(tasksBegan_ - began_).count();
    const double seconds = std::chrono::duration<double>(Clock::now() - tasksBegan_).count();
    progress_.forecast({bytes + firstBytes_, firstSeconds + seconds * scale});
  }

  /// Moves a cell with its descendants into the tree. Returns the greatest error ratio of its polynomials.
  double moveToTree(std::uint32_t node, CheapCell&& cell) {
    if (!cell.children) {
      constexpr double kUnproven = 1.001;  // counts as missed, whatever its error at the checked points
      const double ratio = cell.isMissed ? std::max(cell.leafRatio, kUnproven) : cell.leafRatio;
      tree_.nodes[node].fit = std::move(cell.fit);
      return ratio;
    }
    tree_.split(node, {});
    const std::uint32_t first = tree_.nodes[node].firstChild;
    double greatest = 0;
    for (std::uint32_t child = 0; child < 8; ++child)
      greatest = std::max(greatest, moveToTree(first + child, std::move((*cell.children)[child])));
    cell.children.reset();
    return greatest;
  }

  FieldMetadata metadata(double greatestRatio) const {
    FieldMetadata metadata;
    metadata.source = distance_.source();
    metadata.settings.strategy = setup_.exact ? Strategy::hpx : Strategy::hp;
    metadata.settings.maxDegree = CellLattice::kMostDegree;
    metadata.settings.maxDepth = static_cast<int>(setup_.maxDepth);
    metadata.settings.tolerance = options_.tolerance;
    metadata.settings.within = setup_.fitter.allowed().within;
    metadata.settings.certified = options_.certified;
    metadata.referenceLength = setup_.referenceLength;
    metadata.measuredError = greatestRatio * options_.tolerance;
    metadata.exactEvaluations = setup_.fitter.evaluations();
    return metadata;
  }

  /// Throws `Error` if so many cells, and so many bytes of arrays, do not fit into the allowed memory.
  void requireRoom(double cells, double bytes) const {
    requireMemory({.nodes = std::size_t(cells),
                   .coefficients = std::size_t(bytes / sizeof(double)),
                   .fixedBytes = distance_.bytes()},
                  options_);
  }

  const DistanceFunction& distance_;
  const BuildOptions& options_;
  const Progress& progress_;
  Clock::time_point began_ = Clock::now(), tasksBegan_ = began_;
  ToleranceSetup setup_;
  BuildTree tree_;
  LeastBytes cells_;
  std::vector<CheapCell> roots_;
  std::vector<Task> tasks_;
  std::vector<CheapCell*> divided_;  ///< the cells above the tasks, parents before their children
  std::uint64_t firstCells_ = 0;     ///< number of cells that are no tasks
  double firstBytes_ = 0;            ///< bytes of the field without the tasks
  std::size_t summed_ = 0;           ///< number of tasks whose bytes are in `taskBytes_`
  double taskBytes_ = 0;
  bool hasForecast_ = false;
};

}  // namespace

ToleranceSetup::ToleranceSetup(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                               const Progress& progress)
    : referenceLength(detail::referenceLength(distance.source(), domain)),
      tree{.domain = domain, .grid = options.grid, .nodes = {}},
      fitter(distance, allowedError(options, referenceLength), domain, options.blend, options.certified, progress),
      budget(options),
      exact(exactCellsWithin(distance, options, referenceLength)),
      maxDepth(greatestDepth(options)) {}

FieldData buildWithinTolerance(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                               const Progress& progress) {
  return ToleranceBuild(distance, domain, options, progress).run();
}

}  // namespace hpsdf::detail
