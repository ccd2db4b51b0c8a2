#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>

#include "field/query/evaluate.h"

namespace hpsdf::query {
namespace {

/// The greatest number of bytes of a lookup grid's entries. It lies in memory, although the field may lie in a mapped
/// file; it is the same for fields in memory, because it decides the order in which blended cells are summed.
constexpr std::size_t kMostBytes = std::size_t{1} << 28;

/// For each of the six faces of a leaf, by axis and side, the depth of the deepest leaf that touches the face.
using FaceDepths = std::array<std::array<std::uint8_t, 2>, 3>;

/// Atomically sets `number` to `to` if `to` is greater.
void raise(std::uint8_t& number, std::uint8_t to) {
  const std::atomic_ref shared(number);
  for (std::uint8_t now = shared.load(); now < to && !shared.compare_exchange_weak(now, to);) {
  }
}

/// Updates `deepest`, which has one entry for each face of the leaf `large`. For each face that the smaller leaf `leaf`
/// touches, raises the entry to the depth of `leaf`.
void touchFaces(const OctreeNode& leaf, const OctreeNode& large, FaceDepths& deepest) {
  const int levels = leaf.depth - large.depth;
  const std::int64_t last = (std::int64_t{1} << levels) - 1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t offset = leaf.cellIndex[axis] - (large.cellIndex[axis] << levels);
    if (offset <= 0) raise(deepest[axis][0], static_cast<std::uint8_t>(leaf.depth));
    if (offset >= last) raise(deepest[axis][1], static_cast<std::uint8_t>(leaf.depth));
  }
}

/// Returns for each node how far its blending weight reaches across each of its six faces, packed as in
/// `namespace blend_extent`. The result is 0 for internal nodes.
std::vector<std::uint32_t> findBlendExtents(const FieldData& field) {
  const std::vector<OctreeNode> leaves = allLeaves(field);
  const auto forEachLeaf = [&](const auto& visit) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 64), [&](const auto& range) {
      for (std::size_t n = range.begin(); n < range.end(); ++n) visit(leaves[n]);
    });
  };
  std::vector<FaceDepths> deepest(field.nodes.size());
  forEachLeaf([&](const OctreeNode& leaf) {
    forEachNeighbour(field, leaf, [&](const OctreeNode& neighbour) {
      if (neighbour.depth < leaf.depth) touchFaces(leaf, neighbour, deepest[neighbour.node]);
    });
  });
  std::vector<std::uint32_t> extents(field.nodes.size(), 0);
  forEachLeaf([&](const OctreeNode& leaf) {
    for (int axis = 0; axis < 3; ++axis)
      for (const bool upper : {false, true}) {
        const std::int64_t wall = upper ? (std::int64_t{field.grid[axis]} << leaf.depth) - 1 : 0;
        const int depth = std::max<int>(leaf.depth, deepest[leaf.node][axis][upper]);
        extents[leaf.node] |=
            blend_extent::packed(axis, upper, leaf.cellIndex[axis] == wall ? blend_extent::kDomainFace : depth);
      }
  });
  return extents;
}

/// Fills the entries of the lookup grid from the nodes of its depth and from the leaves of smaller depth. With
/// blending, also fills the blend extents of the entries.
void fillLookupGrid(const FieldData& field, LookupGrid& lookupGrid) {
  visitNodes(field, [&](const OctreeNode& at) {
    if (!node::isLeaf(field.nodes[at.node]) && at.depth < lookupGrid.depth) return true;
    const std::int64_t width = std::int64_t{1} << (lookupGrid.depth - at.depth);
    CellIndex first;  // index of the first entry that the node covers
    for (int axis = 0; axis < 3; ++axis) first[axis] = at.cellIndex[axis] * width;
    for (std::int64_t z = first[2]; z < first[2] + width; ++z)
      for (std::int64_t y = first[1]; y < first[1] + width; ++y) {
        const std::int64_t row = z * lookupGrid.slab + y * lookupGrid.row + first[0];
        std::fill_n(&lookupGrid.entries[row], width, LookupGrid::entry(field.nodes[at.node], at.depth));
        if (field.blend > 0)
          std::fill_n(&lookupGrid.blendExtents[field.nodes.size() + row], width, lookupGrid.blendExtents[at.node]);
      }
    return false;
  });
}

/// Returns the greatest number of bytes of the lookup grid's entries: a share of the field's bytes.
std::size_t mostBytes(const FieldData& field) {
  const std::size_t bytes = coefficientBytes(field) + field.nodes.size() * sizeof(field.nodes[0]);
  const std::size_t share = std::holds_alternative<QuantizedCoefficients>(field.coefficients) ? 8 : 16;
  return std::min(bytes / share, kMostBytes);
}

}  // namespace

LookupGrid makeLookupGrid(const FieldData& field) {
  LookupGrid lookupGrid;
  const std::size_t base = std::size_t(field.grid[0]) * field.grid[1] * field.grid[2];
  const std::size_t maxEntries = mostBytes(field) / sizeof(lookupGrid.entries[0]);
  while (lookupGrid.depth < kMaxDepth && base << (3 * (lookupGrid.depth + 1)) <= maxEntries) ++lookupGrid.depth;
  lookupGrid.entries.resize(base << (3 * lookupGrid.depth));
  if (field.blend > 0) {
    lookupGrid.blendExtents = findBlendExtents(field);
    lookupGrid.blendExtents.resize(field.nodes.size() + lookupGrid.entries.size());
  }
  lookupGrid.frame = gridFrame(field);
  lookupGrid.row = std::int64_t{field.grid[0]} << lookupGrid.depth;
  lookupGrid.slab = lookupGrid.row * (std::int64_t{field.grid[1]} << lookupGrid.depth);
  fillLookupGrid(field, lookupGrid);
  return lookupGrid;
}

}  // namespace hpsdf::query
