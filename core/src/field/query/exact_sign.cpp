#include "hpsdf/detail/exact_sign.h"

#include <array>
#include <cmath>
#include <variant>

#include "hpsdf/detail/triangle_list.h"

namespace hpsdf {
namespace {

/// A segment from the origin, in whose direction points are projected to the plane of two coordinate axes. The segment
/// becomes the origin of this plane.
class Segment {
 public:
  explicit Segment(const Vector3& end) : end_(end) {
    end.cwiseAbs().maxCoeff(&axis_);
    slope_ = Plane(end[(axis_ + 1) % 3], end[(axis_ + 2) % 3]) / end[axis_];
  }

  /// Returns 1 if the segment passes through a triangle from its outer to its inner side, −1 if it passes the other
  /// way, and 0 if it does not pass through.
  ///
  /// The projected outline of the triangle winds around the origin as often as it crosses one half of an axis. For two
  /// triangles with a common side, the crossings of this side cancel to the bit. So the number of passages through the
  /// triangles around an edge or a vertex depends on the outline of them all only: the segment may meet the edge or the
  /// vertex, and rounding errors there do not matter.
  int passageThrough(const std::array<Vector3, 3>& corners) const {
    const std::array<Plane, 3> projected = {project(corners[0]), project(corners[1]), project(corners[2])};
    int turns = 0;
    double along = 0, sum = 0;
    for (int k = 0; k < 3; ++k) {
      const Plane &from = projected[(k + 1) % 3], &to = projected[(k + 2) % 3];
      const double area = from.x() * to.y() - to.x() * from.y();  // twice that of the triangle with the origin
      turns += crossingOf(from, to, area);
      along += std::abs(area) * corners[k].dot(end_);
      sum += std::abs(area);
    }
    // The segment's line passes the triangle at the mean of the corners with these weights. It is on the segment if its
    // projection to the segment is.
    const bool isBetween = along > 0 && along < sum * end_.squaredNorm();
    return !isBetween ? 0 : end_[axis_] > 0 ? -turns : turns;
  }

 private:
  using Plane = Eigen::Vector2d;

  Plane project(const Vector3& x) const { return Plane(x[(axis_ + 1) % 3], x[(axis_ + 2) % 3]) - x[axis_] * slope_; }

  /// Returns 1 if the side of a triangle crosses the positive half of the x axis upwards, −1 if downwards, else 0.
  static int crossingOf(const Plane& from, const Plane& to, double area) {
    const bool startsAbove = from.y() >= 0, endsAbove = to.y() >= 0;
    if (startsAbove == endsAbove) return 0;
    if (endsAbove) return area > 0 ? 1 : 0;
    return area < 0 ? -1 : 0;
  }

  Vector3 end_;
  Eigen::Index axis_ = 0;  ///< the axis along which the segment is longest
  Plane slope_;            ///< of the segment, along the two other axes
};

}  // namespace

std::int64_t windingAt(const ExactTriangles& exact, std::uint64_t leaf, const Vector3& x) {
  const WindingReference reference = referenceOf(exact, leaf);
  const Vector3 origin = reference.point;
  const Segment segment(x - origin);
  std::int64_t winding = reference.winding;
  std::visit(
      [&](const auto& vertices) {
        const auto corner = [&](std::uint32_t index) {
          return Vector3(vertices[index].template cast<double>() - origin);
        };
        forEachTriangle(exact, leaf, [&](std::uint32_t triangle) {
          const auto& [a, b, c] = exact.triangles[triangle];
          winding += segment.passageThrough({corner(a), corner(b), corner(c)});
        });
      },
      exact.vertices);
  return winding;
}

int slopeByWinding(const ExactTriangles& exact, std::uint64_t leaf, const Vector3& x, const Vector3& normal,
                   double height) {
  constexpr double kTouching = 1e-9;  // much more than the rounding errors of positions
  const auto isInside = [&](const Vector3& point) { return windingAt(exact, leaf, point) > 0; };
  const Vector3 origin = referenceOf(exact, leaf).point;
  const double touching = kTouching * ((x - origin).norm() + 1e-3 * x.norm());
  if (std::abs(height) < touching) {
    const Vector3 foot = x - height * normal;
    const bool inFront = isInside(foot + touching * normal), behind = isInside(foot - touching * normal);
    if (inFront != behind) return behind ? 1 : -1;
  }
  return (height < 0) == isInside(x) ? 1 : -1;
}

}  // namespace hpsdf
