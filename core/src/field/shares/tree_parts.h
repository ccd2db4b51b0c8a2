#pragma once
// Parts of an octree that several processes hold together, and the messages that carry them.

#include <array>
#include <compare>
#include <cstdint>
#include <functional>
#include <vector>

#include "field/cells/build_tree.h"
#include "util/message.h"

namespace hpsdf::detail {

/// The place of a cell on the Morton curve: that of its lower corner, in cells of the greatest depth.
struct MortonPlace {
  std::array<std::uint32_t, 3> corner{};

  bool operator==(const MortonPlace&) const = default;
  std::strong_ordering operator<=>(const MortonPlace& other) const;
};

MortonPlace mortonPlaceOf(const CellPlace& cell, int maxDepth);

/// A node of an octree with its fit.
struct TreePart {
  CellPlace place;
  bool isLeaf = true;
  bool isDeferred = false;  ///< the leaf is set aside (`ConstructionState::deferred`)
  Fit fit;
};

/// Returns the fit of a leaf that another process holds. It counts nothing in any sum over leaves.
Fit fitElsewhere();

/// Returns true for a leaf that this process holds, and for an inner node that has a fit.
bool isHeld(const BuildNode& node);

/// Takes parts out of an octree, which other processes hold from now on. `goes(node)` tells whether a node goes, and
/// take(part) gets it. `deferred` are the leaves that are set aside, of which those that stay are left.
void takeOut(BuildTree& tree, std::vector<std::uint32_t>& deferred, const std::function<bool(const BuildNode&)>& goes,
             const std::function<void(TreePart&&)>& take);

/// Puts a part that another process held into an octree. Throws `Error` for more cells than a field can have.
void putIn(BuildTree& tree, std::vector<std::uint32_t>& deferred, TreePart&& part);

/// Removes cells from an octree below which this process holds nothing. The numbers of nodes change.
void dropEmpty(BuildTree& tree, std::vector<std::uint32_t>& deferred);

void write(MessageWriter& message, TreePart& part);
TreePart readPart(MessageReader& message);

}  // namespace hpsdf::detail
