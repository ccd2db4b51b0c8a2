#pragma once
// A check of the transforms of rigid bodies.

#include <Eigen/Geometry>

namespace hpsdf::physics {

/// The greatest deviation of RᵀR from the identity for which R counts as a rotation.
constexpr double kRotationTolerance = 1e-6;

/// Describes why a transform is not a rotation with a translation, for a message in which the owner's name precedes the
/// text; nullptr if it is one. Allocates no memory.
inline const char* transformFault(const Eigen::Isometry3d& transform) {
  if (!transform.matrix().allFinite()) return "transform is not finite";
  const Eigen::Matrix3d rotation = transform.linear();
  const double deviation = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  return deviation <= kRotationTolerance && rotation.determinant() > 0
             ? nullptr
             : "transform is not rigid: give a rotation and a shift";
}

}  // namespace hpsdf::physics
