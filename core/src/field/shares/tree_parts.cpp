#include "field/shares/tree_parts.h"

#include <algorithm>
#include <array>
#include <utility>

#include "field/shares/fit_items.h"

namespace hpsdf::detail {
namespace {

/// Splits a leaf of the octree into children that other processes hold.
void splitElsewhere(BuildTree& tree, std::uint32_t leaf) {
  std::array<Fit, 8> children;
  children.fill(fitElsewhere());
  tree.split(leaf, std::move(children));
}

/// Returns the node of a cell. Splits leaves on the way to it.
std::uint32_t makeNode(BuildTree& tree, const CellPlace& place) {
  const auto indexAt = [&](int axis, std::uint32_t depth) { return place.index[axis] >> (place.depth - depth); };
  std::uint32_t node = indexAt(0, 0) + tree.grid[0] * (indexAt(1, 0) + tree.grid[1] * indexAt(2, 0));
  for (std::uint32_t depth = 1; depth <= place.depth; ++depth) {
    if (tree.nodes[node].firstChild == 0) splitElsewhere(tree, node);
    std::uint32_t child = 0;
    for (int axis = 0; axis < 3; ++axis) child |= (indexAt(axis, depth) & 1) << axis;
    node = tree.nodes[node].firstChild + child;
  }
  return node;
}

}  // namespace

std::strong_ordering MortonPlace::operator<=>(const MortonPlace& other) const {
  // The axis with the highest bit that differs decides; of axes whose highest bits are equal, the last one does.
  int decides = 2;
  std::uint32_t highest = corner[2] ^ other.corner[2];
  for (int axis = 1; axis >= 0; --axis) {
    const std::uint32_t differs = corner[axis] ^ other.corner[axis];
    if (highest >= differs || highest > (highest ^ differs)) continue;
    highest = differs;
    decides = axis;
  }
  return corner[decides] <=> other.corner[decides];
}

MortonPlace mortonPlaceOf(const CellPlace& cell, int maxDepth) {
  MortonPlace place;
  for (int axis = 0; axis < 3; ++axis) place.corner[axis] = cell.index[axis] << (std::uint32_t(maxDepth) - cell.depth);
  return place;
}

Fit fitElsewhere() {
  Fit fit;
  fit.isFinal = true;
  return fit;
}

bool isHeld(const BuildNode& node) {
  return node.firstChild == 0 ? !node.fit.isElsewhere() : !node.fit.coefficients.empty();
}

void takeOut(BuildTree& tree, std::vector<std::uint32_t>& deferred, const std::function<bool(const BuildNode&)>& goes,
             const std::function<void(TreePart&&)>& take) {
  std::vector<bool> isDeferred(tree.nodes.size());
  for (const std::uint32_t leaf : deferred) isDeferred[leaf] = true;
  for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
    BuildNode& node = tree.nodes[n];
    if (!isHeld(node) || !goes(node)) continue;
    const bool isLeaf = node.firstChild == 0;
    take({{node.depth, node.cellIndex}, isLeaf, isDeferred[n], std::move(node.fit)});
    node.fit = isLeaf ? fitElsewhere() : Fit{};
  }
  std::erase_if(deferred, [&](std::uint32_t leaf) { return !isHeld(tree.nodes[leaf]); });
}

void putIn(BuildTree& tree, std::vector<std::uint32_t>& deferred, TreePart&& part) {
  const std::uint32_t node = makeNode(tree, part.place);
  if (part.isDeferred) deferred.push_back(node);
  if (!part.isLeaf && tree.nodes[node].firstChild == 0) splitElsewhere(tree, node);
  tree.nodes[node].fit = std::move(part.fit);
}

void dropEmpty(BuildTree& tree, std::vector<std::uint32_t>& deferred) {
  std::vector<bool> isNeeded(tree.nodes.size());
  for (std::size_t n = tree.nodes.size(); n-- > 0;) {  // children come after their parents
    const std::uint32_t first = tree.nodes[n].firstChild;
    isNeeded[n] = isHeld(tree.nodes[n]);
    for (std::uint32_t child = first; first != 0 && child < first + 8; ++child)
      isNeeded[n] = isNeeded[n] || isNeeded[child];
  }
  std::vector<std::uint32_t> numbers(tree.nodes.size());
  BuildTree kept{.domain = tree.domain, .grid = tree.grid, .nodes = {}};
  const auto keep = [&](std::size_t from) {
    numbers[from] = static_cast<std::uint32_t>(kept.nodes.size());
    BuildNode& node = kept.nodes.emplace_back(std::move(tree.nodes[from]));
    if (node.firstChild == 0 || isNeeded[from]) return;
    node.firstChild = 0;
    node.fit = fitElsewhere();
  };
  for (std::size_t n = 0; n < tree.baseCells(); ++n) keep(n);
  for (std::size_t n = 0; n < kept.nodes.size(); ++n) {
    const std::uint32_t from = kept.nodes[n].firstChild;
    if (from == 0) continue;
    kept.nodes[n].firstChild = static_cast<std::uint32_t>(kept.nodes.size());
    for (std::uint32_t child = from; child < from + 8; ++child) keep(child);
  }
  for (std::uint32_t& leaf : deferred) leaf = numbers[leaf];
  tree = std::move(kept);
}

void write(MessageWriter& message, TreePart& part) {
  message.item(part.place);
  message.flag(part.isLeaf);
  message.flag(part.isDeferred);
  fitItems(message, part.fit, {});
}

TreePart readPart(MessageReader& message) {
  TreePart part;
  message.item(part.place);
  message.flag(part.isLeaf);
  message.flag(part.isDeferred);
  fitItems(message, part.fit, {});
  return part;
}

}  // namespace hpsdf::detail
