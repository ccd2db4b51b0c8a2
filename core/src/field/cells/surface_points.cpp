#include "field/cells/surface_points.h"

#include <bit>

namespace hpsdf::detail {

SurfacePoints::SurfacePoints(const TriangleSearch& search) {
  const auto vertices = search.vertices();
  points_.reserve(search.triangles().size());
  for (const auto& [a, b, c] : search.triangles()) points_.push_back((vertices[a] + vertices[b] + vertices[c]) / 3);

  const std::size_t blocks = std::bit_ceil((points_.size() + kBlock - 1) / kBlock);
  boxes_.resize(2 * blocks);
  for (std::size_t i = 0; i < points_.size(); ++i) boxes_[blocks + i / kBlock].extend(points_[i]);
  for (std::size_t node = blocks; node-- > 1;) boxes_[node] = boxes_[2 * node].merged(boxes_[2 * node + 1]);
}

}  // namespace hpsdf::detail
