#include "field/reach.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "field/visit_nodes.h"

namespace hpsdf {
namespace {

/// A cell of some depth: its place counted in such cells from the domain's lower corner.
using Place = std::array<std::int64_t, 3>;

/// The node there, or the leaf that holds it.
struct Found {
  std::uint32_t node;
  int depth;
};

Found nodeAt(const FieldData& field, const Place& place, int depth) {
  const auto base = [&](int axis) { return place[axis] >> depth; };
  Found at{static_cast<std::uint32_t>((base(2) * field.grid[1] + base(1)) * field.grid[0] + base(0)), 0};
  while (at.depth < depth && !node::isLeaf(field.nodes[at.node])) {
    ++at.depth;
    const auto half = [&](int axis) { return static_cast<std::uint32_t>(place[axis] >> (depth - at.depth)) & 1; };
    at.node = node::firstChild(field.nodes[at.node]) + half(0) + 2 * half(1) + 4 * half(2);
  }
  return at;
}

/// The six sides of one leaf, and the deepest leaf that touches each.
class Sides {
 public:
  Sides(const FieldData& field, const Visited& leaf) : field_(field), depth_(leaf.depth) {
    for (int axis = 0; axis < 3; ++axis) {
      place_[axis] = (std::int64_t{leaf.base[axis]} << depth_) + leaf.path[axis];
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
      bits |= reach::packed(axis, false, place_[axis] == 0 ? reach::kWall : deepest_[axis][0]);
      bits |= reach::packed(axis, true, place_[axis] == last_[axis] ? reach::kWall : deepest_[axis][1]);
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
    const Found found = nodeAt(field_, there, depth_);
    if (!node::isLeaf(field_.nodes[found.node])) descend(found, step, touches);
  }

  /// Through the children of an internal node that touch the leaf.
  void descend(const Found& at, const Place& step, const Touches& touches) {
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
      const Found found{node::firstChild(field_.nodes[at.node]) + child, at.depth + 1};
      if (!node::isLeaf(field_.nodes[found.node])) {
        descend(found, step, ofChild);
        continue;
      }
      for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side)
          if (ofChild[axis][side]) deepest_[axis][side] = std::max(deepest_[axis][side], found.depth);
    }
  }

  const FieldData& field_;
  int depth_;
  Place place_, last_;
  std::array<std::array<int, 2>, 3> deepest_;  ///< by axis and side
};

}  // namespace

std::vector<std::uint32_t> findReaches(const FieldData& field) {
  std::vector<Visited> leaves;
  visitNodes(field, [&](const Visited& at) {
    if (node::isLeaf(field.nodes[at.node])) leaves.push_back(at);
    return true;
  });
  std::vector<std::uint32_t> reaches(field.nodes.size(), 0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 64), [&](const auto& range) {
    for (std::size_t n = range.begin(); n < range.end(); ++n) reaches[leaves[n].node] = Sides(field, leaves[n]).reach();
  });
  return reaches;
}

}  // namespace hpsdf
