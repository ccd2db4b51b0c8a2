#include "field/leaves.h"

#include "field/visit_nodes.h"

namespace hpsdf {

std::vector<Leaf> leavesOf(const FieldData& field) {
  std::vector<Leaf> leaves;
  visitNodes(field, [&](const Visited& at) {
    if (!node::isLeaf(field.nodes[at.node])) return true;
    Leaf& leaf = leaves.emplace_back(Leaf{at.node, at.depth, {}});
    for (int axis = 0; axis < 3; ++axis) leaf.place[axis] = (std::int64_t{at.base[axis]} << at.depth) + at.path[axis];
    return true;
  });
  return leaves;
}

std::optional<Leaf> notSmallerAt(const FieldData& field, const Leaf& leaf, const std::array<int, 3>& steps) {
  auto place = leaf.place;
  for (int axis = 0; axis < 3; ++axis) {
    place[axis] += steps[axis];
    if (place[axis] < 0 || place[axis] >= std::int64_t{field.grid[axis]} << leaf.depth) return {};
  }
  const auto base = [&](int a) { return place[a] >> leaf.depth; };
  Leaf beside{static_cast<std::uint32_t>((base(2) * field.grid[1] + base(1)) * field.grid[0] + base(0)), 0, {}};
  for (; !node::isLeaf(field.nodes[beside.node]); ++beside.depth) {
    if (beside.depth == leaf.depth) return {};
    const auto half = [&](int a) {
      return static_cast<std::uint32_t>(place[a] >> (leaf.depth - beside.depth - 1)) & 1;
    };
    beside.node = node::firstChild(field.nodes[beside.node]) + half(0) + 2 * half(1) + 4 * half(2);
  }
  for (int a = 0; a < 3; ++a) beside.place[a] = place[a] >> (leaf.depth - beside.depth);
  return beside;
}

std::optional<Leaf> notSmallerBeside(const FieldData& field, const Leaf& leaf, int axis, int step) {
  std::array<int, 3> steps{};
  steps[axis] = step;
  return notSmallerAt(field, leaf, steps);
}

}  // namespace hpsdf
