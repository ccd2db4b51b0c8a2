#include "field/kept/kept_leaves.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "basis/projection.h"
#include "field/cells/cell_fit.h"
#include "field/cells/exact_lists.h"
#include "field/nearness.h"
#include "field/query/evaluate.h"
#include "field/query/leaves.h"

namespace hpsdf::detail {
namespace {

constexpr double kRelativeRounding = 1e-12;  // bound of the relative rounding errors of distances and boxes
constexpr std::size_t kAtOnce = 256;

/// Returns the weighted error of a leaf by the embedded estimate. Returns 0 for leaves without error: those outside the
/// field's band, exact ones, and of a field with exact leaves the linear ones, which stand for triangles in one plane.
double embeddedError(const FieldData& field, const Nearness& nearness, std::uint32_t leaf, const Vector3& size) {
  const std::uint64_t bits = field.nodes[leaf];
  if (node::isExact(bits)) return 0;
  return withCoefficients(field, bits, [&](const auto* c) {
    const int degree = node::degree(bits);
    std::array<double, std::size_t(coefficientCount(kMaxDegree))> coefficients;
    std::copy_n(c, coefficientCount(degree), coefficients.begin());
    if (degree == 1 && field.metadata.settings.strategy == Strategy::hpx) return 0.0;
    const double band = field.metadata.settings.band;
    if (band > 0 && std::abs(coefficients[0]) > band + size.norm() / 2) return 0.0;
    return nearness.weight(coefficients[0]) * basis::topDegreeError(coefficients.data(), degree, size.prod());
  });
}

/// A node of the earlier field with its cell.
struct OldCell {
  std::uint32_t node;
  CellPlace place;
  Box box;
};

/// Calls f(i) for parts of a number of cells in parallel: for the part from kAtOnce·i on.
template <typename F>
void forEachPart(std::size_t count, const Progress& progress, const F& f) {
  constexpr std::size_t kBetween = 64;  // parts between two looks at whether the caller cancels
  const std::size_t parts = (count + kAtOnce - 1) / kAtOnce;
  for (std::size_t first = 0; first < parts; first += kBetween) {
    progress.update("finding what stays", double(first) / double(parts));
    tbb::parallel_for(first, std::min(first + kBetween, parts), f);
  }
}

/// Finds the cells that changed triangles do not reach, from the base cells down.
class LeafFinder {
 public:
  LeafFinder(const FieldData& before, const ChangedSurface& change, const Progress& progress)
      : before_(before), change_(change), progress_(progress) {}

  /// Returns the leaves that are kept.
  std::vector<OldCell> find() {
    std::vector<OldCell> level = baseCells(), kept;
    while (!level.empty()) {
      const std::vector<char> stays = stay(level);
      std::vector<OldCell> next;
      for (std::size_t i = 0; i < level.size(); ++i) {
        if (stays[i] != 0)
          addLeaves(level[i], kept);
        else if (!node::isLeaf(before_.nodes[level[i].node]))
          addChildren(level[i], next);
      }
      level = std::move(next);
    }
    return kept;
  }

  std::uint64_t evaluations() const { return evaluations_; }

 private:
  OldCell cellAt(std::uint32_t node, const CellPlace& place) const { return {node, place, cells_.boxOf(place)}; }

  std::vector<OldCell> baseCells() const {
    std::vector<OldCell> cells;
    for (std::uint32_t z = 0; z < before_.grid[2]; ++z)
      for (std::uint32_t y = 0; y < before_.grid[1]; ++y)
        for (std::uint32_t x = 0; x < before_.grid[0]; ++x)
          cells.push_back(cellAt(static_cast<std::uint32_t>(cells.size()), {0, {x, y, z}}));
    return cells;
  }

  void addChildren(const OldCell& cell, std::vector<OldCell>& out) const {
    const std::uint32_t first = node::firstChild(before_.nodes[cell.node]);
    for (std::uint32_t child = 0; child < 8; ++child) out.push_back(cellAt(first + child, cell.place.child(child)));
  }

  void addLeaves(const OldCell& cell, std::vector<OldCell>& out) const {
    if (node::isLeaf(before_.nodes[cell.node])) return out.push_back(cell);
    std::vector<OldCell> children;
    addChildren(cell, children);
    for (const OldCell& child : children) addLeaves(child, out);
  }

  /// Tells for each cell whether it certainly stays as it is.
  std::vector<char> stay(std::span<const OldCell> cells) {
    std::vector<char> stays(cells.size());
    evaluations_ += cells.size();
    forEachPart(cells.size(), progress_, [&](std::size_t part) {
      const std::size_t begin = part * kAtOnce, count = std::min(kAtOnce, cells.size() - begin);
      std::vector<Vector3> centres(count);
      std::vector<double> now(count), toChange(count), winding(count);
      for (std::size_t i = 0; i < count; ++i) centres[i] = cells[begin + i].box.center();
      change_.now(centres, now);
      change_.toChange(centres, toChange);
      if (change_.windingChange) change_.windingChange(centres, winding);
      for (std::size_t i = 0; i < count; ++i)
        stays[begin + i] = isBeyondReach(cells[begin + i].box, now[i], toChange[i]) && std::abs(winding[i]) < 0.5;
    });
    return stays;
  }

  bool isBeyondReach(const Box& cell, double now, double toChange) const {
    const Box box = boxOfWeight(cell, before_.blend);
    const double rounding =
        kRelativeRounding * std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
    const double most = std::abs(now + change_.offset) + box.diagonal().norm();
    return std::abs(toChange) > most * (1 + kRelativeRounding) + rounding;
  }

  const FieldData& before_;
  const ChangedSurface& change_;
  const Progress& progress_;
  BuildTree cells_{.domain = before_.domain, .grid = before_.grid, .nodes = {}};  ///< only for the boxes of cells
  std::uint64_t evaluations_ = 0;
};

/// Makes the tree of the kept leaves, cell by cell.
class TreeMaker {
 public:
  TreeMaker(KeptLeaves& kept, const ExactFit& exactFit, BuildTree& tree, const Progress& progress)
      : kept_(kept), exactFit_(exactFit), tree_(tree), progress_(progress), holdsKept_(kept.before->nodes.size()) {
    for (std::uint32_t base = 0; base < tree.baseCells(); ++base) markKept(base);
  }

  void make() {
    tree_.addBaseCells();
    for (std::uint32_t base = 0; base < tree_.baseCells(); ++base) add(base, base);
    fitExactLeaves();
  }

 private:
  struct ExactLeaf {
    std::uint32_t from, to;  ///< the node in the earlier field and in the tree
  };

  std::uint64_t bitsOf(std::uint32_t node) const { return kept_.before->nodes[node]; }

  /// Finds the nodes of the earlier field below which a leaf is kept.
  bool markKept(std::uint32_t node) {
    bool holds = kept_.isKept[node];
    if (!node::isLeaf(bitsOf(node)))
      for (std::uint32_t child = 0; child < 8; ++child)
        holds = markKept(node::firstChild(bitsOf(node)) + child) || holds;
    return holdsKept_[node] = holds;
  }

  void add(std::uint32_t from, std::uint32_t to) {
    if (!holdsKept_[from]) return;
    if (node::isExact(bitsOf(from))) return exact_.push_back({from, to});
    if (node::isLeaf(bitsOf(from))) {
      tree_.nodes[to].fit = keptFit(bitsOf(from), tree_.boxOf(tree_.nodes[to]));
      return;
    }
    tree_.split(to, {});
    for (std::uint32_t child = 0; child < 8; ++child)
      add(node::firstChild(bitsOf(from)) + child, tree_.nodes[to].firstChild + child);
  }

  Fit keptFit(std::uint64_t bits, const Box& box) const {
    Fit fit;
    fit.degree = node::degree(bits);
    withCoefficients(*kept_.before, bits,
                     [&](const auto* c) { fit.coefficients.assign(c, c + coefficientCount(fit.degree)); });
    fit.isFinal = true;
    fit.error.volume = box.volume();
    return fit;
  }

  void fitExactLeaves() {
    std::vector<char> isFound(exact_.size());
    forEachPart(exact_.size(), progress_, [&](std::size_t part) {
      for (std::size_t i = part * kAtOnce; i < std::min((part + 1) * kAtOnce, exact_.size()); ++i) {
        BuildNode& node = tree_.nodes[exact_[i].to];
        std::optional<Fit> fit = exactFit_(tree_.boxOf(node));
        isFound[i] = fit.has_value();
        if (fit) node.fit = std::move(*fit);
      }
    });
    for (std::size_t i = 0; i < exact_.size(); ++i) {
      if (isFound[i] != 0) continue;
      kept_.isKept[exact_[i].from] = false;
      --kept_.kept;
      kept_.keptVolume -= tree_.boxOf(tree_.nodes[exact_[i].to]).volume() / tree_.domain.volume();
    }
  }

  KeptLeaves& kept_;
  const ExactFit& exactFit_;
  BuildTree& tree_;
  const Progress& progress_;
  std::vector<bool> holdsKept_;  ///< by node of the earlier field
  std::vector<ExactLeaf> exact_;
};

}  // namespace

KeptLeaves KeptLeaves::none(const FieldData& before) {
  KeptLeaves kept{.before = &before, .isKept = std::vector<bool>(before.nodes.size())};
  for (const std::uint64_t bits : before.nodes) kept.leaves += node::isLeaf(bits) ? 1 : 0;
  return kept;
}

KeptLeaves findKeptLeaves(const Field& before, const ChangedSurface& change, const Progress& progress) {
  const FieldData& data = before.data();
  LeafFinder finder(data, change, progress);
  KeptLeaves kept = KeptLeaves::none(data);
  for (const OldCell& leaf : finder.find()) {
    kept.isKept[leaf.node] = true;
    ++kept.kept;
    kept.keptVolume += leaf.box.volume() / data.domain.volume();
  }
  kept.evaluations = finder.evaluations();

  const Nearness nearness = nearnessOf(data.metadata.settings, data.domain);
  double keptError = 0, otherError = 0;
  query::visitNodes(data, [&](const query::OctreeNode& at) {
    if (!node::isLeaf(data.nodes[at.node])) return true;
    (kept.isKept[at.node] ? keptError : otherError) +=
        embeddedError(data, nearness, at.node, query::cellSize(data, at.depth));
    return true;
  });
  if (keptError > 0) kept.keptError = keptError / (keptError + otherError);
  return kept;
}

void makeTree(KeptLeaves& kept, const ExactFit& exactFit, BuildTree& tree, const Progress& progress) {
  TreeMaker(kept, exactFit, tree, progress).make();
}

KeptSteps keptSteps(const KeptLeaves& kept, const FieldData& field) {
  const auto* quantized = std::get_if<QuantizedCoefficients>(&kept.before->coefficients);
  if (quantized == nullptr || kept.kept == 0) return {};
  KeptSteps result{.step = quantized->step, .steps = std::vector<double>(field.nodes.size())};
  struct Pair {
    std::uint32_t before, now;
  };
  std::vector<Pair> stack;
  const std::uint32_t baseCells = field.grid[0] * field.grid[1] * field.grid[2];
  for (std::uint32_t base = 0; base < baseCells; ++base) stack.push_back({base, base});
  while (!stack.empty()) {
    const Pair at = stack.back();
    stack.pop_back();
    const std::uint64_t before = kept.before->nodes[at.before], now = field.nodes[at.now];
    if (node::isLeaf(before)) {
      if (kept.isKept[at.before] && !node::isExact(before) && node::isLeaf(now))
        result.steps[at.now] = quantized->stepOf(before);
    } else if (!node::isLeaf(now)) {
      for (std::uint32_t child = 0; child < 8; ++child)
        stack.push_back({node::firstChild(before) + child, node::firstChild(now) + child});
    }
  }
  return result;
}

}  // namespace hpsdf::detail
