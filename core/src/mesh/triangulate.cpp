#include "mesh/triangulate.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

namespace hpsdf {
namespace {

using Vector2 = Eigen::Vector2d;

double cross(const Vector2& u, const Vector2& v) { return u.x() * v.y() - u.y() * v.x(); }

/// The polygon as seen along the coordinate axis nearest to its normal, anticlockwise.
std::vector<Vector2> flattened(std::span<const Vector3> polygon) {
  Vector3 normal = Vector3::Zero();
  for (std::size_t i = 2; i < polygon.size(); ++i)
    normal += (polygon[i - 1] - polygon[0]).cross(polygon[i] - polygon[0]);
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  Eigen::Index right = (axis + 1) % 3;
  Eigen::Index up = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(right, up);
  std::vector<Vector2> points;
  for (const Vector3& corner : polygon)
    points.emplace_back(corner[right] - polygon[0][right], corner[up] - polygon[0][up]);
  return points;
}

/// Ear clipping: cuts off one convex corner after another that has no other corner in its triangle.
class EarClipper {
 public:
  explicit EarClipper(std::span<const Vector3> polygon) : points_(flattened(polygon)), left_(points_.size()) {
    const auto n = static_cast<std::uint32_t>(left_);
    for (std::uint32_t i = 0; i < n; ++i) {
      next_.push_back((i + 1) % n);
      previous_.push_back((i + n - 1) % n);
    }
  }

  std::vector<std::array<std::uint32_t, 3>> clip() {
    // Positions come from float, where a corner on a straight side is off it by rounding: ears as thin as that, and
    // ears whose cut runs past a corner as closely as that, would leave slivers with normals of noise. They come
    // second.
    constexpr double kRounding = 1e-4;
    while (left_ > 3) {
      std::optional<std::uint32_t> ear = findEar(kRounding);
      if (!ear) ear = findEar(0);
      cut(ear ? *ear : flattestCorner());
    }
    if (left_ == 3) cut(start_);
    return std::move(triangles_);
  }

 private:
  std::optional<std::uint32_t> findEar(double tolerance) const {
    std::uint32_t corner = start_;
    for (std::size_t i = 0; i < left_; ++i, corner = next_[corner])
      if (isEar(corner, tolerance)) return corner;
    return std::nullopt;
  }

  /// `tolerance`: how far from straight the corner is, and other corners from the triangle, relative to its sides.
  bool isEar(std::uint32_t corner, double tolerance) const {
    const std::array<Vector2, 3> ear = {points_[previous_[corner]], points_[corner], points_[next_[corner]]};
    const Vector2 in = ear[1] - ear[0];
    const Vector2 out = ear[2] - ear[1];
    if (!(cross(in, out) > tolerance * in.norm() * out.norm())) return false;
    for (std::uint32_t other = next_[next_[corner]]; other != previous_[corner]; other = next_[other])
      if (isNear(points_[other], ear, tolerance)) return false;
    return true;
  }

  /// Inside or on the border, but not at a corner: polygons with a slit pass through a point twice.
  static bool isNear(const Vector2& p, const std::array<Vector2, 3>& ear, double tolerance) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector2 side = ear[(i + 1) % 3] - ear[i];
      if (p == ear[i] || cross(side, p - ear[i]) < -tolerance * side.squaredNorm()) return false;
    }
    return true;
  }

  /// For what is left of a polygon that is flat to a line or crosses itself.
  std::uint32_t flattestCorner() const {
    std::uint32_t best = start_;
    double least = std::numeric_limits<double>::infinity();
    std::uint32_t corner = start_;
    for (std::size_t i = 0; i < left_; ++i, corner = next_[corner]) {
      const Vector2& p = points_[corner];
      const double area = std::abs(cross(p - points_[previous_[corner]], points_[next_[corner]] - p));
      if (area >= least) continue;
      least = area;
      best = corner;
    }
    return best;
  }

  void cut(std::uint32_t corner) {
    const std::uint32_t before = previous_[corner];
    const std::uint32_t after = next_[corner];
    triangles_.push_back({before, corner, after});
    next_[before] = after;
    previous_[after] = before;
    start_ = next_[after];  // not the neighbour: it would soon be the tip of a fan
    --left_;
  }

  std::vector<Vector2> points_;
  std::vector<std::uint32_t> next_;
  std::vector<std::uint32_t> previous_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::uint32_t start_ = 0;
  std::size_t left_;  ///< corners not yet cut off
};

}  // namespace

std::vector<std::array<std::uint32_t, 3>> triangulate(std::span<const Vector3> polygon) {
  if (polygon.size() == 3) return {{0, 1, 2}};
  return EarClipper(polygon).clip();
}

}  // namespace hpsdf
