#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf::distance {

/// Replaces points far from a mesh by nearer ones in the same direction from the centre of the mesh's box.
///
/// At r = 10¹⁵ times the size D of a mesh, all of its triangles are equally far to rounding, so that the nearest one
/// cannot be found. The distance along a ray, less the length of the ray, changes by at most D²/r beyond the radius r.
/// Beyond 2²⁷ D, this is less than the rounding error of the distance. A far point therefore has the nearest triangle
/// of a point at that radius, and a distance that is greater by the distance between the two points.
class FarPoints {
 public:
  FarPoints() = default;
  /// `wall` is half of the thickness of a shell, which is subtracted from every unsigned distance, and 0 for other
  /// inside tests.
  explicit FarPoints(const Box& mesh, double wall = 0)
      : center_(mesh.center()), aroundMesh_(widened(mesh)), radius_(kFar * mesh.sizes().norm()), wall_(wall) {
    if (!(radius_ > 0)) radius_ = HUGE_VAL;  // a mesh that is one point is equally far in all directions
  }

  /// Returns true for a finite point so far away that it is replaced.
  bool isFar(const Vector3& x) const {
    const Vector3 away = (x - center_).cwiseAbs();
    return (away.x() > radius_ || away.y() > radius_ || away.z() > radius_) && x.allFinite();
  }
  bool areAnyFar(std::span<const Vector3> points) const {
    for (const Vector3& x : points)
      if (isFar(x)) return true;
    return false;
  }

  /// Returns a far point's nearer point, and any other point as it is.
  Vector3 nearer(const Vector3& x) const {
    if (!isFar(x)) return x;
    const Vector3 away = x - center_;
    return center_ + (away / away.cwiseAbs().maxCoeff()).normalized() * radius_;
  }
  std::vector<Vector3> nearer(std::span<const Vector3> points) const {
    std::vector<Vector3> result(points.begin(), points.end());
    for (Vector3& x : result) x = nearer(x);
    return result;
  }

  /// Evaluates signed distances of any points and, unless `directions` is empty, the unit vectors from the nearest
  /// triangles. `near(points, distances, directions)` does so for points none of which is far.
  template <typename Near>
  void evaluate(std::span<const Vector3> points, std::span<double> out, std::span<Vector3> directions,
                const Near& near) const {
    if (!areAnyFar(points)) return near(points, out, directions);
    const std::vector<Vector3> nearerPoints = nearer(points);
    near(nearerPoints, out, directions);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!isFar(points[i])) continue;
      if (!directions.empty()) directions[i] = continuedDirection(directions[i], out[i], points[i], nearerPoints[i]);
      out[i] = continued(out[i], points[i], nearerPoints[i]);
    }
  }

  /// Returns the signed distance of a far point x from that of its nearer point.
  double continued(double distance, const Vector3& x, const Vector3& nearer) const {
    const double more = (x - nearer).stableNorm();
    const bool isInside = distance < 0 && wall_ == 0;
    return isInside ? distance - more : distance + more;
  }

  /// Gives all points around a mesh the same side, if it is known. Pseudonormals do not tell it far away, where the
  /// triangles of two walls are equally near to rounding.
  void applySideAround(std::span<const Vector3> points, std::span<double> distances) const {
    if (!isInsideAround_) return;
    for (std::size_t i = 0; i < points.size(); ++i)
      if (isAround(points[i])) distances[i] = std::copysign(distances[i], *isInsideAround_ ? -1 : 1);
  }
  /// Makes the side of all points around the mesh known.
  void setSideAround(bool isInside) { isInsideAround_ = isInside; }

  /// Returns true for a point at least as far outside of the mesh's box as the box is wide.
  bool isAround(const Vector3& x) const { return !aroundMesh_.contains(x); }
  /// Returns a point that is around the mesh.
  Vector3 pointAround() const { return aroundMesh_.max() + (aroundMesh_.max() - center_); }

 private:
  static constexpr double kFar = 0x1p27;

  /// Returns the unit vector to a far point x from the triangle nearest to it. Its nearer point has this signed
  /// distance and this direction.
  Vector3 continuedDirection(const Vector3& direction, double distance, const Vector3& x, const Vector3& nearer) const {
    const double toTriangle = wall_ > 0 ? distance + wall_ : std::abs(distance);
    const Vector3 away = (x - nearer) + toTriangle * direction;
    return (away / away.cwiseAbs().maxCoeff()).normalized();
  }

  static Box widened(const Box& box) {
    const Vector3 by = Vector3::Constant(box.sizes().norm());
    return Box(box.min() - by, box.max() + by);
  }

  Vector3 center_ = Vector3::Zero();
  Box aroundMesh_;
  double radius_ = HUGE_VAL;
  double wall_ = 0;
  std::optional<bool> isInsideAround_;  ///< the side of all points around the mesh; only for chosen pseudonormals
};

}  // namespace hpsdf::distance
