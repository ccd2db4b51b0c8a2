#include "field/build/tolerance_build.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "field/build/least_bytes.h"
#include "field/build/limits.h"
#include "field/cells/cell_bounds.h"
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
/// divided further are the tasks of the construction, which are done in random order, so that the first ones tell what
/// all of them will take.
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
    for (CheapCell& root : roots_) settleFirstDepths(root, 0);
    double worst = 0;
    for (std::uint32_t n = 0; n < roots_.size(); ++n) worst = std::max(worst, moveToTree(n, std::move(roots_[n])));
    FieldData field = layOut(std::move(tree_), metadata(worst), distance_.triangleSearch());
    roundCoefficients(options_.coefficients, field);
    field.blend = options_.blend;
    if (options_.bounds) field.metadata.exactEvaluations += findBounds(field, distance_, progress_);
    return field;
  }

 private:
  struct Task {
    CheapCell* cell;
    CellPlace place;
    double ratioAbove;
  };

  /// Makes leaves of the cells of a depth, and divides those whose children may take fewer bytes, until there are
  /// enough cells that are not divided yet for tasks.
  void lookAtFirstDepths() {
    constexpr std::size_t kEnough = 500;
    for (std::uint32_t n = 0; n < roots_.size(); ++n) tasks_.push_back({&roots_[n], {0, tree_.nodes[n].cellIndex}, 0});
    while (!tasks_.empty() && tasks_.size() < kEnough && firstDepths_ < int(setup_.maxDepth)) {
      progress_.update("fitting first cells", 0);
      std::vector<std::uint8_t> divides(tasks_.size());
      tbb::parallel_for(std::size_t{0}, tasks_.size(), [&](std::size_t t) {
        divides[t] = cells_.makeLeaf(*tasks_[t].cell, tasks_[t].place, tasks_[t].ratioAbove);
      });
      std::vector<Task> next;
      for (std::size_t t = 0; t < tasks_.size(); ++t) {
        if (divides[t] == 0) continue;
        CheapCell& cell = *tasks_[t].cell;
        LeastBytes::divide(cell);
        for (std::uint32_t child = 0; child < 8; ++child)
          next.push_back({&(*cell.children)[child], tasks_[t].place.child(child), cell.ratio});
      }
      tasks_ = std::move(next);
      ++firstDepths_;
    }
    firstCells_ = cells_.cells();
  }

  void doTasks() {
    constexpr std::size_t kRounds = 50, kFewestAtOnce = 16;
    tasksBegan_ = Clock::now();
    shuffleTasks();
    const std::size_t atOnce = std::max(kFewestAtOnce, tasks_.size() / kRounds);
    for (std::size_t done = 0; done < tasks_.size();) {
      progress_.update("fitting cells", double(done) / double(tasks_.size()));
      const std::size_t end = std::min(done + atOnce, tasks_.size());
      tbb::parallel_for(
          done, end, [&](std::size_t t) { cells_.solve(*tasks_[t].cell, tasks_[t].place, tasks_[t].ratioAbove); },
          tbb::simple_partitioner{});
      done = end;
      forecast(done);
    }
  }

  void shuffleTasks() {
    std::mt19937_64 random;  // always with the same seed
    for (std::size_t t = tasks_.size(); t > 1; --t) std::swap(tasks_[t - 1], tasks_[random() % t]);
  }

  /// Estimates what the whole construction takes from the tasks that are done. Reports it once, and throws `Error` if
  /// it is more than the memory allows.
  void forecast(std::size_t done) {
    constexpr std::size_t kShare = 14;  // the forecast is made after one of so many tasks
    for (; summed_ < done; ++summed_) taskBytes_ += tasks_[summed_].cell->bytes;
    const double scale = double(tasks_.size()) / double(done), bytes = taskBytes_ * scale;
    // Cells are in memory as they are built, and again as the arrays of the field are made.
    requireRoom(double(firstCells_) + double(cells_.cells() - firstCells_) * scale, 2 * bytes);
    if (hasForecast_ || done * kShare < tasks_.size()) return;
    hasForecast_ = true;
    if (!progress_.forecast) return;
    const double firstSeconds = std::chrono::duration<double>(tasksBegan_ - began_).count();
    const double seconds = std::chrono::duration<double>(Clock::now() - tasksBegan_).count();
    progress_.forecast({bytes + firstBytes(), firstSeconds + seconds * scale});
  }

  /// Returns the bytes of the leaves of the first depths, which are no tasks, and of the cells that were divided there.
  double firstBytes() const {
    double bytes = 0;
    for (const CheapCell& root : roots_) bytes += firstBytesOf(root, 0);
    return bytes;
  }
  double firstBytesOf(const CheapCell& cell, int depth) const {
    if (depth == firstDepths_) return 0;
    if (!cell.children) return cell.bytes;
    double bytes = setup_.budget.nodeBytes();
    for (const CheapCell& child : *cell.children) bytes += firstBytesOf(child, depth + 1);
    return std::min(bytes, cell.bytes);
  }

  void settleFirstDepths(CheapCell& cell, int depth) {
    if (depth == firstDepths_ || !cell.children) return;
    for (CheapCell& child : *cell.children) settleFirstDepths(child, depth + 1);
    cells_.settle(cell);
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
  int firstDepths_ = 0;  ///< number of depths that `lookAtFirstDepths` looked at
  std::uint64_t firstCells_ = 0;
  std::size_t summed_ = 0;  ///< number of tasks whose bytes are in `taskBytes_`
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
