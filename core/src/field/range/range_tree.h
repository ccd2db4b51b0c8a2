#pragma once
// The tree of enclosures from which ranges over boxes are found.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "field/range/enclosure.h"
#include "field/range/leaf_enclosures.h"
#include "hpsdf/detail/field_data.h"
#include "hpsdf/detail/lookup_grid.h"
#include "hpsdf/field.h"
#include "hpsdf/types.h"

namespace hpsdf::range {

/// The enclosures of eight cells, rounded outward, by number x + 2y + 4z. A cell that is not there has the range from
/// infinity to −infinity.
struct alignas(64) Group {
  std::array<float, 8> lower, upper, x, y, z;  ///< `Enclosure::lower`, `upper` and the components of `gradient`
  std::array<float, 8> min, max;
  std::array<std::uint32_t, 8> link;  ///< a group, or with `kTerminalBit` set the field's node of a leaf

  static constexpr std::uint32_t kTerminalBit = std::uint32_t{1} << 31;
};

/// The data of the cells of a group that a query needs only where it evaluates the leaf.
struct Details {
  std::array<float, 8> bend, noise;
  std::uint8_t levelsBelowLeaf = 0;  ///< 0 for nodes of the octree, 1 for the eighths of a leaf, and so on
  std::uint8_t uncertainSigns = 0;   ///< bit mask of the cells with `Enclosure::isSignUncertain`
};

/// A cube in grid coordinates.
struct Cube {
  std::array<double, 3> centre;
  double half;  ///< half of its edge, which is the unit of local coordinates
};

/// The intervals of a field's values and of the exact distance in a box. `distance` is empty, from infinity to
/// −infinity, for a field without bounds.
struct Extent {
  Interval value, distance;
};

/// A tree above and below the nodes of a field's octree. Above the base cells, cells are merged up to a single one.
/// Below a leaf that is far from linear, there are parts of the leaf.
class RangeTree {
 public:
  /// Keeps a reference to the field. Uses the threads of the calling TBB arena. With `relevant`, ranges without such
  /// values may be wide.
  RangeTree(const Field& field, const std::optional<Interval>& relevant);

  const GridFrame& frame() const { return frame_; }

  bool hasBounds() const { return !errors_.empty(); }

  /// Returns the range over a box of the domain. With `known`, the range is only tight where it reaches beyond these
  /// values.
  Extent range(const Box& box, const std::optional<Interval>& known) const;

  std::size_t bytes() const;

 private:
  friend class TreeBuilder;
  friend class RangeSearch;

  const FieldData& field_;
  const GridFrame& frame_;
  double reach_;                              ///< see `reachOf`
  Cube root_;                                 ///< the cell that the first group divides
  std::vector<Group> groups_;                 ///< the first one is the root's
  std::vector<Details> details_;              ///< one for each group
  std::vector<std::array<float, 8>> errors_;  ///< `Enclosure::error`, one for each group; empty without bounds
};

}  // namespace hpsdf::range
