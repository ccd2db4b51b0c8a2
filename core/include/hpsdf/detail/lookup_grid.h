#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace hpsdf {

/// The field's domain and the base grid of its octree along x, y and z.
struct GridFrame {
  std::array<double, 3> lower, upper, size;  ///< the domain's corners and edge lengths in world units
  std::array<double, 3> cells;               ///< number of base cells along each axis
  std::array<std::int64_t, 3> last;          ///< greatest grid coordinate in fixed point with kMaxDepth fractional bits
};

/// A regular grid that holds the octree's nodes of one depth. Queries start their descent of the octree in this
/// grid. The grid is computed when a field is constructed, and is not stored in files.
struct LookupGrid {
  GridFrame frame;
  int depth = 0;
  std::int64_t row = 0, slab = 0;  ///< number of entries in a row along x, and in a plane of x and y
  /// Octree nodes, x fastest, with the depth of each node in bits 40 to 47. A leaf that is less deep than `depth`
  /// covers several entries.
  std::vector<std::uint64_t> entries;
  /// The distances up to which each leaf is blended across its six faces, packed as `namespace blend_extent` describes:
  /// one element for each octree node (0 for an internal node), then one for each element of `entries`. The list is
  /// empty for a field without blending.
  std::vector<std::uint32_t> blendExtents;

  static constexpr std::uint64_t entry(std::uint64_t node, int depth) { return node | std::uint64_t(depth) << 40; }
  static constexpr int depthOf(std::uint64_t entry) { return static_cast<int>(entry >> 40 & 0xff); }
};

}  // namespace hpsdf
