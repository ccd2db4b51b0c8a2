#pragma once
// Points of the surface, at which the signed distance is known without a search.

#include <algorithm>
#include <cstddef>
#include <vector>

#include "hpsdf/detail/triangle_search.h"
#include "hpsdf/types.h"

namespace hpsdf::detail {

/// The centroids of all triangles of a surface, in a binary hierarchy of boxes.
class SurfacePoints {
 public:
  explicit SurfacePoints(const TriangleSearch& search);

  /// Calls `visit` for every centroid in the closed box, in the order of the triangles.
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
    if (node < blocks) {
      visitNode(2 * node, box, visit);
      visitNode(2 * node + 1, box, visit);
      return;
    }
    const std::size_t first = (node - blocks) * kBlock;
    for (std::size_t i = first; i < std::min(first + kBlock, points_.size()); ++i)
      if (box.contains(points_[i])) visit(points_[i]);
  }

  std::vector<Vector3> points_;  ///< in the order of the triangles, in which neighbours in space are close
  std::vector<Box> boxes_;       ///< node n ≥ 1 has the children 2n and 2n + 1; the second half are the leaves
};

}  // namespace hpsdf::detail
