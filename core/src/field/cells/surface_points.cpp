#include "field/cells/surface_points.h"

#include <bit>
#include <utility>

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

/// Returns the corners of the part of a triangle that lies in a cell: clips the triangle by the planes of the six
/// faces, one after another (Sutherland & Hodgman 1974).
std::vector<Vector3> SurfaceInCells::partInCell(std::uint32_t triangle, const Box& cell) const {
  std::vector<Vector3> part;
  for (const std::uint32_t corner : search_.triangles()[triangle]) part.push_back(search_.vertices()[corner]);
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2;
    const bool isUpper = face % 2 != 0;
    const auto depthOf = [&](const Vector3& point) {
      return isUpper ? cell.max()[axis] - point[axis] : point[axis] - cell.min()[axis];
    };
    std::vector<Vector3> kept;
    for (std::size_t i = 0; i < part.size(); ++i) {
      const Vector3 &from = part[i], &to = part[(i + 1) % part.size()];
      const double depthFrom = depthOf(from), depthTo = depthOf(to);
      if (depthFrom >= 0) kept.push_back(from);
      if ((depthFrom >= 0) != (depthTo >= 0)) kept.push_back(from + depthFrom / (depthFrom - depthTo) * (to - from));
    }
    part = std::move(kept);
  }
  return part;
}

}  // namespace hpsdf::detail
