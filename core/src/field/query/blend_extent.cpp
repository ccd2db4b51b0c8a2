#include "field/query/blend_extent.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "field/query/leaves.h"

namespace hpsdf::query {
namespace {

/// Finds the deepest leaf that touches each face of one leaf.
class FaceNeighbourhood {
 public:
  FaceNeighbourhood(const FieldData& field, const OctreeNode& leaf)
      : field_(field), depth_(leaf.depth), cellIndex_(leaf.cellIndex) {
    for (int axis = 0; axis < 3; ++axis) {
      last_[axis] = (std::int64_t{field.grid[axis]} << depth_) - 1;
      deepest_[axis] = {depth_, depth_};
    }
  }

  /// Returns the leaf's blend extents as `namespace blend_extent` packs them.
  std::uint32_t packedExtents() {
    CellIndex step;
    for (step[2] = -1; step[2] <= 1; ++step[2])
      for (step[1] = -1; step[1] <= 1; ++step[1])
        for (step[0] = -1; step[0] <= 1; ++step[0])
          if (step != CellIndex{0, 0, 0}) visitNeighbour(step);
    using namespace blend_extent;
    std::uint32_t bits = 0;
    for (int axis = 0; axis < 3; ++axis) {
      bits |= packed(axis, false, cellIndex_[axis] == 0 ? kDomainFace : deepest_[axis][0]);
      bits |= packed(axis, true, cellIndex_[axis] == last_[axis] ? kDomainFace : deepest_[axis][1]);
    }
    return bits;
  }

 private:
  /// The faces of the leaf, by axis and side, that a neighbouring node touches.
  using Touches = std::array<std::array<bool, 2>, 3>;

  /// Visits the cell of the leaf's size that is `step` cells away. Larger leaves there do not change the extents.
  void visitNeighbour(const CellIndex& step) {
    CellIndex neighbour;
    Touches touches;
    for (int axis = 0; axis < 3; ++axis) {
      neighbour[axis] = cellIndex_[axis] + step[axis];
      if (neighbour[axis] < 0 || neighbour[axis] > last_[axis]) return;
      touches[axis] = {step[axis] <= 0, step[axis] >= 0};
    }
    const std::uint32_t found = nodeAt(field_, neighbour, depth_).node;
    if (!node::isLeaf(field_.nodes[found])) descend(found, depth_, step, touches);
  }

  /// Visits the leaves below an internal node that touch the leaf.
  void descend(std::uint32_t node, int depth, const CellIndex& step, const Touches& touches) {
    for (std::uint32_t child = 0; child < 8; ++child) {
      Touches childTouches = touches;
      if (!restrictToChild(child, step, childTouches)) continue;
      const std::uint32_t found = node::firstChild(field_.nodes[node]) + child;
      if (!node::isLeaf(field_.nodes[found])) {
        descend(found, depth + 1, step, childTouches);
        continue;
      }
      for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side)
          if (childTouches[axis][side]) deepest_[axis][side] = std::max(deepest_[axis][side], depth + 1);
    }
  }

  /// Removes the faces that only the child's siblings touch. Returns whether the child touches the leaf at all.
  static bool restrictToChild(std::uint32_t child, const CellIndex& step, Touches& touches) {
    bool touching = true;
    for (int axis = 0; axis < 3; ++axis) {
      const bool upper = (child >> axis & 1) != 0;
      if (step[axis] == 0)
        touches[axis][upper ? 0 : 1] = false;
      else
        touching &= upper == (step[axis] < 0);
    }
    return touching;
  }

  const FieldData& field_;
  int depth_;
  CellIndex cellIndex_;
  CellIndex last_;                             ///< greatest cell index in the grid at the leaf's depth
  std::array<std::array<int, 2>, 3> deepest_;  ///< depth of the deepest touching leaf by axis and side
};

}  // namespace

std::vector<std::uint32_t> findBlendExtents(const FieldData& field) {
  const std::vector<OctreeNode> leaves = allLeaves(field);
  std::vector<std::uint32_t> extents(field.nodes.size(), 0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 64), [&](const auto& range) {
    for (std::size_t n = range.begin(); n < range.end(); ++n)
      extents[leaves[n].node] = FaceNeighbourhood(field, leaves[n]).packedExtents();
  });
  return extents;
}

}  // namespace hpsdf::query
