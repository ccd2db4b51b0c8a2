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

constexpr int kMaxDegree = 30;
constexpr int kMaxDepth = 20;  ///< so that a cell's local coordinate keeps 32 bits of a double's 52

/// Of `FieldData::blend`: with more the zones at opposite faces of a cell could meet.
constexpr double kMaxBlend = 0.25;

/// n(p) = (p+1)(p+2)(p+3)/6: coefficients of a polynomial of total degree p (paper, sec. 3.3).
constexpr int coefficientCount(int degree) { return (degree + 1) * (degree + 2) * (degree + 3) / 6; }

}  // namespace hpsdf
