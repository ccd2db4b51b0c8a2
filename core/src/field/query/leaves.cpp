#include "field/query/leaves.h"

namespace hpsdf::query {

std::vector<OctreeNode> allLeaves(const FieldData& field) {
  std::vector<OctreeNode> leaves;
  visitNodes(field, [&](const OctreeNode& at) {
    if (node::isLeaf(field.nodes[at.node])) leaves.push_back(at);
    return true;
  });
  return leaves;
}

OctreeNode nodeAt(const FieldData& field, const CellIndex& cellIndex, int depth) {
  const auto base = [&](int axis) { return cellIndex[axis] >> depth; };
  OctreeNode at{static_cast<std::uint32_t>((base(2) * field.grid[1] + base(1)) * field.grid[0] + base(0)), 0, {}};
  while (at.depth < depth && !node::isLeaf(field.nodes[at.node])) {
    ++at.depth;
    const auto half = [&](int axis) { return static_cast<std::uint32_t>(cellIndex[axis] >> (depth - at.depth)) & 1; };
    at.node = node::firstChild(field.nodes[at.node]) + half(0) + 2 * half(1) + 4 * half(2);
  }
  for (int axis = 0; axis < 3; ++axis) at.cellIndex[axis] = cellIndex[axis] >> (depth - at.depth);
  return at;
}

std::optional<OctreeNode> equalOrLargerNeighbour(const FieldData& field, const OctreeNode& leaf,
                                                 const std::array<int, 3>& steps) {
  CellIndex cellIndex = leaf.cellIndex;
  for (int axis = 0; axis < 3; ++axis) {
    cellIndex[axis] += steps[axis];
    if (cellIndex[axis] < 0 || cellIndex[axis] >= std::int64_t{field.grid[axis]} << leaf.depth) return {};
  }
  const OctreeNode neighbour = nodeAt(field, cellIndex, leaf.depth);
  if (!node::isLeaf(field.nodes[neighbour.node])) return {};
  return neighbour;
}

}  // namespace hpsdf::query
