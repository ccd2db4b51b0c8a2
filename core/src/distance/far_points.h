#pragma once

#include <cmath>
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
  explicit FarPoints(const Box& mesh)
      : center_(mesh.center()), aroundMesh_(widened(mesh)), radius_(kFar * mesh.sizes().norm()) {
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

  /// Returns the signed distance of a far point x from that of its nearer point.
  static double continued(double distance, bool isInside, const Vector3& x, const Vector3& nearer) {
    const double more = (x - nearer).stableNorm();
    return isInside ? distance - more : distance + more;
  }
  /// Returns the unit vector to a far point x from the triangle nearest to it. Its nearer point has the distance
  /// `toTriangle` from this triangle, in this direction.
  static Vector3 continuedDirection(const Vector3& direction, double toTriangle, const Vector3& x,
                                    const Vector3& nearer) {
    const Vector3 away = (x - nearer) + toTriangle * direction;
    return (away / away.cwiseAbs().maxCoeff()).normalized();
  }

  /// Returns true for a point at least as far outside of the mesh's box as the box is wide.
  bool isAround(const Vector3& x) const { return !aroundMesh_.contains(x); }
  /// Returns a point that is around the mesh.
  Vector3 pointAround() const { return aroundMesh_.max() + (aroundMesh_.max() - center_); }

 private:
  static constexpr double kFar = 0x1p27;

  static Box widened(const Box& box) {
    const Vector3 by = Vector3::Constant(box.sizes().norm());
    return Box(box.min() - by, box.max() + by);
  }

  Vector3 center_ = Vector3::Zero();
  Box aroundMesh_;
  double radius_ = HUGE_VAL;
};

}  // namespace hpsdf::distance
