#include "field/query/blend_extent.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "field/query/leaves.h"

namespace hpsdf {
namespace {

using Place = std::array<std::int64_t, 3>;  ///< as that of a `Leaf`

/// The six sides of one leaf, and the deepest leaf that touches each.
class Sides {
 public:
  Sides(const FieldData& field, const Leaf& leaf) : field_(field), depth_(leaf.depth), place_(leaf.place) {
    for (int axis = 0; axis < 3; ++axis) {
      last_[axis] = (std::int64_t{field.grid[axis]} << depth_) - 1;
      deepest_[axis] = {depth_, depth_};
    }
  }

  std::uint32_t reach() {
    Place step;
    for (step[2] = -1; step[2] <= 1; ++step[2])
      for (step[1] = -1; step[1] <= 1; ++step[1])
        for (step[0] = -1; step[0] <= 1; ++step[0])
          if (step != Place{0, 0, 0}) look(step);
    std::uint32_t bits = 0;
    for (int axis = 0; axis < 3; ++axis) {
      bits |= blend_extent::packed(axis, false, place_[axis] == 0 ? blend_extent::kWall : deepest_[axis][0]);
      bits |= blend_extent::packed(axis, true, place_[axis] == last_[axis] ? blend_extent::kWall : deepest_[axis][1]);
    }
    return bits;
  }

 private:
  /// Which of the leaf's two sides along each axis a node touches that touches the leaf.
  using Touches = std::array<std::array<bool, 2>, 3>;

  /// At the cell of the same size so many steps away: larger leaves there change nothing.
  void look(const Place& step) {
    Place there;
    Touches touches;
    for (int axis = 0; axis < 3; ++axis) {
      there[axis] = place_[axis] + step[axis];
      if (there[axis] < 0 || there[axis] > last_[axis]) return;
      touches[axis] = {step[axis] <= 0, step[axis] >= 0};
    }
    const std::uint32_t found = nodeAt(field_, there, depth_).node;
    if (!node::isLeaf(field_.nodes[found])) descend(found, depth_, step, touches);
  }

  /// Through the children of an internal node that touch the leaf.
  void descend(std::uint32_t node, int depth, const Place& step, const Touches& touches) {
    for (std::uint32_t child = 0; child < 8; ++child) {
      Touches ofChild = touches;
      bool beside = true;
      for (int axis = 0; axis < 3; ++axis) {
        const bool upper = (child >> axis & 1) != 0;
        if (step[axis] == 0)
          ofChild[axis][upper ? 0 : 1] = false;
        else
          beside &= upper == (step[axis] < 0);
      }
      if (!beside) continue;
      const std::uint32_t found = node::firstChild(field_.nodes[node]) + child;
      if (!node::isLeaf(field_.nodes[found])) {
        descend(found, depth + 1, step, ofChild);
        continue;
      }
      for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side)
          if (ofChild[axis][side]) deepest_[axis][side] = std::max(deepest_[axis][side], depth + 1);
    }
  }

  const FieldData& field_;
  int depth_;
  Place place_, last_;
  std::array<std::array<int, 2>, 3> deepest_;  ///< by axis and side
};

}  // namespace

std::vector<std::uint32_t> findBlendExtents(const FieldData& field) {
  const std::vector<Leaf> leaves = leavesOf(field);
  std::vector<std::uint32_t> blendExtents(field.nodes.size(), 0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 64), [&](const auto& range) {
    for (std::size_t n = range.begin(); n < range.end(); ++n)
      blendExtents[leaves[n].node] = Sides(field, leaves[n]).reach();
  });
  return blendExtents;
}

}  // namespace hpsdf
