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

constexpr double kRounding = 1e-12;  // bound of the relative rounding errors of distances and boxes
constexpr std::size_t kAtOnce = 256;

/// Returns the weighted error of a leaf by the embedded estimate.
double embeddedError(const FieldData& field, const Nearness& nearness, std::uint32_t leaf, double volume) {
  const std::uint64_t bits = field.nodes[leaf];
  if (node::isExact(bits)) return 0;
  return withCoefficients(field, bits, [&](const auto* c) {
    const int degree = node::degree(bits);
    std::array<double, std::size_t(coefficientCount(kMaxDegree))> coefficients;
    std::copy_n(c, coefficientCount(degree), coefficients.begin());
    return nearness.weight(coefficients[0]) * basis::topDegreeError(coefficients.data(), degree, volume);
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
class Sieve {
 public:
  Sieve(const Field& before, const ChangedSurface& change, const Progress& progress)
      : before_(before), data_(before.data()), change_(change), progress_(progress) {
    slack_ = 10 * before.metadata().rmsEstimate(before.domain());
  }

  /// Returns the leaves that are kept.
  std::vector<OldCell> sift() {
    std::vector<OldCell> level = baseCells(), kept;
    while (!level.empty()) {
      const std::vector<char> reached = areReached(level);
      std::vector<OldCell> next;
      for (std::size_t i = 0; i < level.size(); ++i) {
        if (reached[i] == 0)
          addLeaves(level[i], kept);
        else if (!node::isLeaf(data_.nodes[level[i].node]))
          addChildren(level[i], next);
      }
      level = std::move(next);
    }
    return change_.checksSigns ? withRightSigns(std::move(kept)) : kept;
  }

  std::uint64_t evaluations() const { return evaluations_; }

 private:
  OldCell cellAt(std::uint32_t node, const CellPlace& place) const { return {node, place, cells_.boxOf(place)}; }

  std::vector<OldCell> baseCells() const {
    std::vector<OldCell> cells;
    for (std::uint32_t z = 0; z < data_.grid[2]; ++z)
      for (std::uint32_t y = 0; y < data_.grid[1]; ++y)
        for (std::uint32_t x = 0; x < data_.grid[0]; ++x)
          cells.push_back(cellAt(static_cast<std::uint32_t>(cells.size()), {0, {x, y, z}}));
    return cells;
  }

  void addChildren(const OldCell& cell, std::vector<OldCell>& out) const {
    const std::uint32_t first = node::firstChild(data_.nodes[cell.node]);
    for (std::uint32_t child = 0; child < 8; ++child) out.push_back(cellAt(first + child, cell.place.child(child)));
  }

  void addLeaves(const OldCell& cell, std::vector<OldCell>& out) const {
    if (node::isLeaf(data_.nodes[cell.node])) return out.push_back(cell);
    std::vector<OldCell> children;
    addChildren(cell, children);
    for (const OldCell& child : children) addLeaves(child, out);
  }

  /// Tells for each cell whether a changed triangle may reach it.
  std::vector<char> areReached(std::span<const OldCell> cells) {
    std::vector<char> reached(cells.size());
    evaluations_ += cells.size();
    forEachPart(cells.size(), progress_, [&](std::size_t part) {
      const std::size_t begin = part * kAtOnce, count = std::min(kAtOnce, cells.size() - begin);
      std::vector<Vector3> centres(count);
      std::vector<double> now(count), toChange(count);
      for (std::size_t i = 0; i < count; ++i) centres[i] = cells[begin + i].box.center();
      change_.now(centres, now);
      change_.toChange(centres, toChange);
      for (std::size_t i = 0; i < count; ++i) {
        const Box box = boxOfWeight(cells[begin + i].box, data_.blend);
        const double most = std::abs(now[i] + change_.offset) + box.diagonal().norm();
        reached[begin + i] = !(std::abs(toChange[i]) > most * (1 + kRounding) + rounding(box));
      }
    });
    return reached;
  }

  static double rounding(const Box& box) {
    return kRounding * std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  }

  /// Returns the leaves in which the field and Φ have the same signs, as far as can be told.
  std::vector<OldCell> withRightSigns(std::vector<OldCell>&& leaves) {
    std::vector<char> isRight(leaves.size());
    std::vector<std::uint64_t> evaluations((leaves.size() + kAtOnce - 1) / kAtOnce);
    forEachPart(leaves.size(), progress_, [&](std::size_t part) {
      for (std::size_t i = part * kAtOnce; i < std::min((part + 1) * kAtOnce, leaves.size()); ++i)
        isRight[i] = hasRightSigns(leaves[i].box, evaluations[part]);
    });
    for (const std::uint64_t count : evaluations) evaluations_ += count;
    std::vector<OldCell> right;
    for (std::size_t i = 0; i < leaves.size(); ++i)
      if (isRight[i] != 0) right.push_back(leaves[i]);
    return right;
  }

  bool hasRightSigns(const Box& box, std::uint64_t& evaluations) const {
    std::array<Vector3, 9> points;
    std::array<double, 9> now;
    points[0] = box.center();
    change_.now(std::span(points).first(1), std::span(now).first(1));
    ++evaluations;
    if (!agrees(points[0], now[0])) return false;
    if (std::abs(now[0]) > box.diagonal().norm() / 2) return true;
    for (int k = 0; k < 8; ++k)
      for (int axis = 0; axis < 3; ++axis)
        points[k + 1][axis] = (k >> axis & 1) != 0 ? box.max()[axis] : box.min()[axis];
    change_.now(points, now);
    evaluations += now.size();
    for (std::size_t k = 1; k < points.size(); ++k)
      if (!agrees(points[k], now[k])) return false;
    return true;
  }

  /// Returns true if the field and Φ have the same sign at a point, or if Φ is within the field's error.
  bool agrees(const Vector3& x, double now) const {
    return std::abs(now) <= slack_ || (now < 0) == (before_.value(x) < 0);
  }

  const Field& before_;
  const FieldData& data_;
  const ChangedSurface& change_;
  const Progress& progress_;
  BuildTree cells_{.domain = data_.domain, .grid = data_.grid, .nodes = {}};  ///< only for the boxes of cells
  double slack_;  ///< magnitude of distances whose signs the field need not have right
  std::uint64_t evaluations_ = 0;
};

/// Makes the tree of the kept leaves, cell by cell.
class Planter {
 public:
  Planter(const KeptLeaves& kept, const ExactFit& exactFit, BuildTree& tree)
      : kept_(kept), exactFit_(exactFit), tree_(tree), holdsKept_(kept.before->nodes.size()) {
    for (std::uint32_t base = 0; base < tree.baseCells(); ++base) markKept(base);
  }

  void plant() {
    tree_.addBaseCells();
    for (std::uint32_t base = 0; base < tree_.baseCells(); ++base) plant(base, base);
  }

 private:
  std::uint64_t bitsOf(std::uint32_t node) const { return kept_.before->nodes[node]; }

  /// Finds the nodes of the earlier field below which a leaf is kept.
  bool markKept(std::uint32_t node) {
    bool holds = kept_.isKept[node];
    if (!node::isLeaf(bitsOf(node)))
      for (std::uint32_t child = 0; child < 8; ++child) holds = markKept(node::firstChild(bitsOf(node)) + child) || holds;
    return holdsKept_[node] = holds;
  }

  void plant(std::uint32_t from, std::uint32_t to) {
    if (!holdsKept_[from]) return;
    if (node::isLeaf(bitsOf(from))) {
      tree_.nodes[to].fit = keptFit(bitsOf(from), tree_.boxOf(tree_.nodes[to]));
      return;
    }
    tree_.split(to, {});
    for (std::uint32_t child = 0; child < 8; ++child)
      plant(node::firstChild(bitsOf(from)) + child, tree_.nodes[to].firstChild + child);
  }

  /// Returns the fit of a kept leaf; one without coefficients if the list of an exact leaf is not found.
  Fit keptFit(std::uint64_t bits, const Box& box) const {
    Fit fit;
    if (node::isExact(bits)) return exactFit_(box).value_or(Fit{});
    fit.degree = node::degree(bits);
    withCoefficients(*kept_.before, bits, [&](const auto* c) {
      fit.coefficients.assign(c, c + coefficientCount(fit.degree));
    });
    fit.isFinal = true;
    fit.error.volume = box.volume();
    return fit;
  }

  const KeptLeaves& kept_;
  const ExactFit& exactFit_;
  BuildTree& tree_;
  std::vector<bool> holdsKept_;  ///< by node of the earlier field
};

}  // namespace

KeptLeaves findKeptLeaves(const Field& before, const ChangedSurface& change, const Progress& progress) {
  const FieldData& data = before.data();
  const Nearness nearness = nearnessOf(data.metadata.settings, data.domain);
  const auto errorOf = [&](std::uint32_t leaf, double volume) { return embeddedError(data, nearness, leaf, volume); };
  Sieve sieve(before, change, progress);
  KeptLeaves kept{.before = &data, .isKept = std::vector<bool>(data.nodes.size())};
  double keptError = 0, error = 0;
  for (const OldCell& leaf : sieve.sift()) {
    kept.isKept[leaf.node] = true;
    ++kept.kept;
    kept.keptVolume += leaf.box.volume() / data.domain.volume();
    keptError += errorOf(leaf.node, leaf.box.volume());
  }
  query::visitNodes(data, [&](const query::OctreeNode& at) {
    if (!node::isLeaf(data.nodes[at.node])) return true;
    ++kept.leaves;
    error += errorOf(at.node, query::cellSize(data, at.depth).prod());
    return true;
  });
  if (error > 0) kept.errorOfOthers = std::max(0.0, 1 - keptError / error);
  kept.evaluations = sieve.evaluations();
  return kept;
}

void plant(const KeptLeaves& kept, const ExactFit& exactFit, BuildTree& tree) { Planter(kept, exactFit, tree).plant(); }

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
