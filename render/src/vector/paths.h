#pragma once
// Paths of vector pictures: joins short lines to long ones, and leaves out points that do not change their course.

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "hpsdf/render/vector_picture.h"
#include "image/pixel_rect.h"

namespace hpsdf::render {

/// The area that pixels cover.
inline Eigen::AlignedBox2d areaOf(const PixelRect& rect) {
  return {Eigen::Vector2d(rect.x0, rect.y0), Eigen::Vector2d(rect.x1, rect.y1)};
}

/// Numbers points. Points that are closer to each other than `kSamePoint` get the same number.
class PointNumbers {
 public:
  static constexpr double kSamePoint = 1e-4;  // pixels; rounding errors are far below this, visible lengths far above

  /// Returns the number of a point: that of an earlier point in the same place, or the next free number.
  int operator()(const Eigen::Vector2d& point);

  const std::vector<Eigen::Vector2d>& points() const { return points_; }

 private:
  std::vector<Eigen::Vector2d> points_;
  std::unordered_map<std::uint64_t, std::vector<int>> buckets_;
};

/// A straight line between two numbered points.
using Link = std::array<int, 2>;

/// Joins lines that share ends to polylines which are as long as possible. Every link becomes part of exactly one of
/// them. The result depends on nothing but the arguments.
std::vector<Polyline> joinedLinks(std::span<const Link> links, const std::vector<Eigen::Vector2d>& points);

/// Leaves out points of a line so that it moves by at most `tolerance` (Douglas and Peucker, "Algorithms for the
/// reduction of the number of points required to represent a digitized line", 1973).
Polyline simplified(const Polyline& line, double tolerance);

}  // namespace hpsdf::render
