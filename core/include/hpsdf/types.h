#pragma once
// The value types that every room shares.

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace hpsdf {

using Vector3 = Eigen::Vector3d;

/// Axis-aligned box, `min()` and `max()` corners in world units.
using Box = Eigen::AlignedBox3d;

/// A uniform scale about a centre: y = scale·(x − center).
struct Normalization {
  Vector3 center = Vector3::Zero();
  double scale = 1;

  bool isIdentity() const { return scale == 1 && center.isZero(0); }
};

}  // namespace hpsdf
