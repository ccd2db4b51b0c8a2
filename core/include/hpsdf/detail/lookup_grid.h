#pragma once
// Where queries start their descent through the octree.

#include <array>
#include <cstdint>
#include <vector>

namespace hpsdf {

/// The base grid as queries need it: numbers along x, y and z.
struct GridFrame {
  std::array<double, 3> lower, upper, size;  ///< of the domain
  std::array<double, 3> cells;               ///< their number
  std::array<std::int64_t, 3> last;          ///< of the places in the grid, kMaxDepth binary digits after the point
};

/// Where queries start their descent: the nodes of the octree at one depth, laid out as a grid, so that a point finds
/// its own at once. Made from the nodes when a field is; not stored.
struct LookupGrid {
  GridFrame frame;
  int depth = 0;
  std::int64_t row = 0, slab = 0;  ///< entries along x, along x and y
  /// x fastest. A node's bits, bits 40 to 47 its depth: below `depth` for a leaf that covers several entries.
  std::vector<std::uint64_t> entries;
  /// How far the leaves of a blended field reach (`namespace reach`): by node, then by entry; 0 where that is no leaf.
  /// Empty without blending.
  std::vector<std::uint32_t> blendExtents;

  static constexpr std::uint64_t entry(std::uint64_t node, int depth) { return node | std::uint64_t(depth) << 40; }
  static constexpr int depthOf(std::uint64_t entry) { return static_cast<int>(entry >> 40 & 0xff); }
};

}  // namespace hpsdf
