#pragma once
// Points of the surface, at which the signed distance is known without a search.

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "hpsdf/detail/triangle_search.h"
#include "hpsdf/types.h"

namespace hpsdf::detail {

/// The centroids of all triangles of a surface, in a binary hierarchy of boxes.
class SurfacePoints {
 public:
  explicit SurfacePoints(const TriangleSearch& search);

  /// Calls `visit` for centroids in the closed box, in the order of the triangles: for all of them or, where the box
  /// contains very many, for one of sixteen.
  template <typename F>
  void forEachIn(const Box& box, const F& visit) const {
    visitNode(1, box, visit);
  }

 private:
  static constexpr std::size_t kBlock = 16;  ///< number of points of a leaf of the hierarchy

  template <typename F>
  void visitNode(std::size_t node, const Box& box, const F& visit) const {
    if (!box.intersects(boxes_[node])) return;
    const std::size_t blocks = boxes_.size() / 2;
    constexpr std::size_t kMany = 4096;  // blocks that are visited point by point
    if (box.contains(boxes_[node]) && (std::bit_width(blocks) - std::bit_width(node)) >= std::bit_width(kMany))
      return visitFirstOfBlocks(node, visit);
    if (node < blocks) {
      visitNode(2 * node, box, visit);
      visitNode(2 * node + 1, box, visit);
      return;
    }
    const std::size_t first = (node - blocks) * kBlock;
    for (std::size_t i = first; i < std::min(first + kBlock, points_.size()); ++i)
      if (box.contains(points_[i])) visit(points_[i]);
  }

  /// Visits the first point of each block below a node.
  template <typename F>
  void visitFirstOfBlocks(std::size_t node, const F& visit) const {
    const std::size_t blocks = boxes_.size() / 2;
    std::size_t first = node, last = node;
    while (first < blocks) {
      first = 2 * first;
      last = 2 * last + 1;
    }
    for (std::size_t block = first; block <= last; ++block)
      if ((block - blocks) * kBlock < points_.size()) visit(points_[(block - blocks) * kBlock]);
  }

  std::vector<Vector3> points_;  ///< in the order of the triangles, in which neighbours in space are close
  std::vector<Box> boxes_;       ///< node n ≥ 1 has the children 2n and 2n + 1; the second half are the leaves
};

/// Points of a surface in cells: the corners and centroids of the parts of triangles that lie in a cell or, where there
/// are very many triangles, centroids of triangles.
class SurfaceInCells {
 public:
  /// Keeps a reference to the search.
  explicit SurfaceInCells(const TriangleSearch& search) : search_(search), centroids_(search) {}

  /// Calls visit(point) for points of the surface in a cell, in a fixed order.
  template <typename F>
  void forEachIn(const Box& cell, const F& visit) const {
    constexpr std::size_t kMost = 256;
    const std::optional<TriangleList> list = search_.nearestTo(cell, kMost);
    if (!list) return centroids_.forEachIn(cell, visit);
    for (const std::uint32_t triangle : list->triangles) {
      const std::vector<Vector3> part = partInCell(triangle, cell);
      if (part.empty()) continue;
      Vector3 sum = Vector3::Zero();
      for (const Vector3& corner : part) {
        sum += corner;
        visit(corner);
      }
      visit(Vector3(sum / double(part.size())));
    }
  }

  /// Distances are measured to the surface and made smaller by this length: half of the thickness of a shell.
  double offset() const { return search_.offset(); }

 private:
  std::vector<Vector3> partInCell(std::uint32_t triangle, const Box& cell) const;

  const TriangleSearch& search_;
  SurfacePoints centroids_;
};

}  // namespace hpsdf::detail
