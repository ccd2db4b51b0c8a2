#pragma once
// Traversal of the nodes of a field's octree with their cell indices, and search for the neighbours of leaves.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "hpsdf/detail/field_data.h"

namespace hpsdf::query {

/// Integer coordinates of a cell, counted from the domain's lower corner in units of cells of the same depth.
using CellIndex = std::array<std::int64_t, 3>;

/// A node of the octree and its cell.
struct OctreeNode {
  std::uint32_t node;  ///< index into `FieldData::nodes`
  int depth;
  CellIndex cellIndex;
};

/// Calls visit(OctreeNode) for the nodes in depth-first order: base cells from first to last, and the children 0 to 7
/// of a node after the node. The children of an internal node are visited only if `visit` returns true for the node.
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

/// The polynomial degree for which the faces of exact leaves are sampled. The distance there is no polynomial: its
/// trace on a face is smooth except for a few bends.
constexpr int kExactSampleDegree = 6;

/// Returns the polynomial degree for which the faces of a leaf are sampled.
constexpr int sampleDegree(std::uint64_t leaf) { return node::isExact(leaf) ? kExactSampleDegree : node::degree(leaf); }

/// Returns all leaves in depth-first order.
std::vector<OctreeNode> allLeaves(const FieldData& field);

/// Returns the node of the cell with this index and depth. If the octree has no such node, returns the larger
/// leaf that holds the cell.
OctreeNode nodeAt(const FieldData& field, const CellIndex& cellIndex, int depth);

/// Returns the leaf that holds the cell at an offset of `steps` from `leaf`, counted in cells of the size of
/// `leaf`. The result is as large as `leaf` or larger. Returns std::nullopt if the cell is subdivided or lies
/// outside the domain.
std::optional<OctreeNode> equalOrLargerNeighbour(const FieldData& field, const OctreeNode& leaf,
                                                 const std::array<int, 3>& steps);

/// Calls f(neighbour) for each of the 26 directions in which the neighbour of `leaf` is as large as `leaf` or
/// larger. A larger neighbour is visited once for each direction in which it lies.
template <typename F>
void forEachNeighbour(const FieldData& field, const OctreeNode& leaf, const F& f) {
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if (x != 0 || y != 0 || z != 0)
          if (const auto neighbour = equalOrLargerNeighbour(field, leaf, {x, y, z})) f(*neighbour);
}

/// Calls f(axis, step, neighbour) for the faces of `leaf` towards larger leaves, and for its upper faces towards leaves
/// of equal size. If the function is called for all leaves, it visits each face between two leaves exactly once. The
/// step is −1 for a face at the lower end of the axis and 1 for a face at the upper end.
template <typename F>
void forEachInterface(const FieldData& field, const OctreeNode& leaf, const F& f) {
  for (int axis = 0; axis < 3; ++axis)
    for (const int step : {-1, 1}) {
      std::array<int, 3> steps{};
      steps[axis] = step;
      const auto neighbour = equalOrLargerNeighbour(field, leaf, steps);
      if (neighbour && (neighbour->depth < leaf.depth || step > 0)) f(axis, step, *neighbour);
    }
}

}  // namespace hpsdf::query
