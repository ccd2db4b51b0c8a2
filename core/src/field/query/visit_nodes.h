#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hpsdf/detail/field_data.h"

namespace hpsdf {

/// A node on a way through the whole octree.
struct Visited {
  std::uint32_t node;
  int depth;
  std::array<std::uint32_t, 3> base;  ///< base cell
  std::array<std::uint32_t, 3> path;  ///< its place within the base cell, in cells of its depth
};

/// In cells of its depth, counted from the domain's lower corner.
inline std::array<std::int64_t, 3> placeOf(const Visited& at) {
  std::array<std::int64_t, 3> place;
  for (int axis = 0; axis < 3; ++axis) place[axis] = (std::int64_t{at.base[axis]} << at.depth) + at.path[axis];
  return place;
}

/// Base cells first to last, children 0 to 7; below an internal node where `visit` returns true for it.
template <typename Visit>
void visitNodes(const FieldData& field, Visit&& visit) {
  std::vector<Visited> stack;
  std::uint32_t root = 0;
  for (std::uint32_t z = 0; z < field.grid[2]; ++z)
    for (std::uint32_t y = 0; y < field.grid[1]; ++y)
      for (std::uint32_t x = 0; x < field.grid[0]; ++x) {
        stack.push_back({root++, 0, {x, y, z}, {0, 0, 0}});
        while (!stack.empty()) {
          const Visited at = stack.back();
          stack.pop_back();
          const std::uint64_t bits = field.nodes[at.node];
          if (!visit(at) || node::isLeaf(bits)) continue;
          for (std::uint32_t child = 8; child-- > 0;)
            stack.push_back(
                {node::firstChild(bits) + child,
                 at.depth + 1,
                 at.base,
                 {2 * at.path[0] + (child & 1), 2 * at.path[1] + (child >> 1 & 1), 2 * at.path[2] + (child >> 2)}});
        }
      }
}

}  // namespace hpsdf
