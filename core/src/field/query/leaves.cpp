#include "field/query/leaves.h"

#include "field/query/visit_nodes.h"

namespace hpsdf {

std::vector<Leaf> leavesOf(const FieldData& field) {
  std::vector<Leaf> leaves;
  visitNodes(field, [&](const Visited& at) {
    if (!node::isLeaf(field.nodes[at.node])) return true;
    leaves.push_back({at.node, at.depth, placeOf(at)});
    return true;
  });
  return leaves;
}

Leaf nodeAt(const FieldData& field, const std::array<std::int64_t, 3>& place, int depth) {
  const auto base = [&](int a) { return place[a] >> depth; };
  Leaf at{static_cast<std::uint32_t>((base(2) * field.grid[1] + base(1)) * field.grid[0] + base(0)), 0, {}};
  while (at.depth < depth && !node::isLeaf(field.nodes[at.node])) {
    ++at.depth;
    const auto half = [&](int a) { return static_cast<std::uint32_t>(place[a] >> (depth - at.depth)) & 1; };
    at.node = node::firstChild(field.nodes[at.node]) + half(0) + 2 * half(1) + 4 * half(2);
  }
  for (int a = 0; a < 3; ++a) at.place[a] = place[a] >> (depth - at.depth);
  return at;
}

std::optional<Leaf> notSmallerAt(const FieldData& field, const Leaf& leaf, const std::array<int, 3>& steps) {
  auto place = leaf.place;
  for (int axis = 0; axis < 3; ++axis) {
    place[axis] += steps[axis];
    if (place[axis] < 0 || place[axis] >= std::int64_t{field.grid[axis]} << leaf.depth) return {};
  }
  const Leaf beside = nodeAt(field, place, leaf.depth);
  if (!node::isLeaf(field.nodes[beside.node])) return {};
  return beside;
}

std::optional<Leaf> notSmallerBeside(const FieldData& field, const Leaf& leaf, int axis, int step) {
  std::array<int, 3> steps{};
  steps[axis] = step;
  return notSmallerAt(field, leaf, steps);
}

}  // namespace hpsdf
