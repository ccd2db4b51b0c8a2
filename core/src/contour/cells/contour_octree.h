#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf::contouring {

/// Integer coordinates of a point of the contour's grid, in units of the smallest cells.
using GridPoint = std::array<std::int32_t, 3>;

/// A cell of the contour's octree: a cube.
struct ContourCell {
  GridPoint lower;
  std::int32_t size;        ///< edge in units of the smallest cells, a power of two
  std::int32_t child = -1;  ///< the first of eight successive children, or −1 for a leaf

  bool isLeaf() const { return child < 0; }
};

/// An octree of cubes around a domain. Child n of a cell is its upper half along axis k if bit k of n is set.
class ContourOctree {
 public:
  static constexpr int kDepth = 20;  ///< the smallest cells have an edge of 2^-kDepth of a root's

  /// Covers `domain` by root cells with this edge. The grid is shifted against the domain by a fraction that hardly any
  /// shape has, because surfaces in the planes of the grid would be special cases.
  ContourOctree(const Box& domain, double rootEdge);

  std::span<const ContourCell> cells() const { return cells_; }
  const ContourCell& operator[](std::int32_t cell) const { return cells_[static_cast<std::size_t>(cell)]; }

  /// Divides leaves, each given once.
  void divide(std::span<const std::int32_t> leaves);

  /// Returns the leaf that holds the cube of the smallest size above a point, or −1 outside all roots.
  std::int32_t leafAt(const GridPoint& point) const;

  Vector3 position(const GridPoint& point) const { return origin_ + unit_ * Vector3(point[0], point[1], point[2]); }
  Box box(const ContourCell& cell) const;
  double edge(const ContourCell& cell) const { return unit_ * cell.size; }
  double smallestEdge() const { return unit_; }

 private:
  Vector3 origin_;
  double unit_;
  std::array<std::int32_t, 3> roots_;  ///< number of root cells along each axis
  std::vector<ContourCell> cells_;     ///< roots first, x fastest
};

}  // namespace hpsdf::contouring
