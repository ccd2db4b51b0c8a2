#pragma once
// The nodes of a field's octree with their cell indices, and the neighbours of leaves.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "hpsdf/detail/field_data.h"

namespace hpsdf::query {

/// Integer coordinates of a cell in cells of its depth, counted from the domain's lower corner.
using CellIndex = std::array<std::int64_t, 3>;

/// A node of the octree and its cell.
struct OctreeNode {
  std::uint32_t node;  ///< index into `FieldData::nodes`
  int depth;
  CellIndex cellIndex;
};

/// Calls visit(OctreeNode) for the nodes in the order of the octree: base cells first to last, children 0 to 7. An
/// internal node's children are visited only where `visit` returns true for it.
template <typename Visit>
void visitNodes(const FieldData& field, Visit&& visit) {
  std::vector<OctreeNode> stack;
  std::uint32_t root = 0;
  for (std::uint32_t z = 0; z < field.grid[2]; ++z)
    for (std::uint32_t y = 0; y < field.grid[1]; ++y)
      for (std::uint32_t x = 0; x < field.grid[0]; ++x) {
        stack.push_back({root++, 0, {x, y, z}});
        while (!stack.empty()) {
          const auto [node, depth, index] = stack.back();
          stack.pop_back();
          const std::uint64_t bits = field.nodes[node];
          if (!visit(OctreeNode{node, depth, index}) || node::isLeaf(bits)) continue;
          for (std::uint32_t child = 8; child-- > 0;)
            stack.push_back(
                {node::firstChild(bits) + child,
                 depth + 1,
                 {2 * index[0] + (child & 1), 2 * index[1] + (child >> 1 & 1), 2 * index[2] + (child >> 2)}});
        }
      }
}

/// Returns all leaves in the order of the octree.
std::vector<OctreeNode> allLeaves(const FieldData& field);

/// Returns the node of a cell, or the leaf that holds the cell where the octree ends above it.
OctreeNode nodeAt(const FieldData& field, const CellIndex& cellIndex, int depth);

/// Returns the leaf, as large as `leaf` or larger, that holds the cell `steps` cells of the leaf's size away; nothing
/// where that cell is subdivided or lies outside the domain.
std::optional<OctreeNode> equalOrLargerNeighbour(const FieldData& field, const OctreeNode& leaf,
                                                 const std::array<int, 3>& steps);

/// Returns the leaf, as large as `leaf` or larger, across the face of `leaf` at the lower (step −1) or upper (step 1)
/// end of an axis; nothing where smaller leaves lie there or the domain ends.
std::optional<OctreeNode> equalOrLargerFaceNeighbour(const FieldData& field, const OctreeNode& leaf, int axis,
                                                     int step);

}  // namespace hpsdf::query
