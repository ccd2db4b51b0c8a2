#pragma once
// A check that the transform of a rigid body is a rigid motion.

#include <Eigen/Geometry>

namespace hpsdf::physics {

/// A matrix R counts as a rotation if each entry of RᵀR deviates from the identity by at most this value.
constexpr double kRotationTolerance = 1e-6;

/// Returns a text that says why a transform is not a rotation followed by a translation, or nullptr if the transform is
/// rigid. In messages, the name of the transform's owner precedes the returned text. Allocates no memory.
inline const char* transformFault(const Eigen::Isometry3d& transform) {
  if (!transform.matrix().allFinite()) return "transform is not finite";
  const Eigen::Matrix3d rotation = transform.linear();
  const double deviation = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  return deviation <= kRotationTolerance && rotation.determinant() > 0
             ? nullptr
             : "transform is not rigid: give a rotation and a shift";
}

}  // namespace hpsdf::physics
