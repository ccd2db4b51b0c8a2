#pragma once
// The leaves of a field by their places, and who lies beside whom.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "hpsdf/detail/field_data.h"

namespace hpsdf {

/// A leaf, or any node, and its place, in cells of its depth counted from the domain's lower corner.
struct Leaf {
  std::uint32_t node;
  int depth;
  std::array<std::int64_t, 3> place;
};

/// In the order of the octree.
std::vector<Leaf> leavesOf(const FieldData& field);

/// The node that is the cell at this place of this depth, or the larger leaf that holds it.
Leaf nodeAt(const FieldData& field, const std::array<std::int64_t, 3>& place, int depth);

/// The leaf of the same size or a larger one that holds the cell so many steps of a leaf's size away; none where
/// smaller ones lie there, or nothing.
std::optional<Leaf> notSmallerAt(const FieldData& field, const Leaf& leaf, const std::array<int, 3>& steps);

/// The leaf of the same size or a larger one across a leaf's face; none where smaller ones lie there, or nothing.
std::optional<Leaf> notSmallerBeside(const FieldData& field, const Leaf& leaf, int axis, int step);

}  // namespace hpsdf
