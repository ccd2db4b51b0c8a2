#pragma once

#include <Eigen/Geometry>

#include "hpsdf/types.h"

namespace hpsdf::physics {

/// By how much the products of a rotation's columns may differ from those of the axes.
constexpr double kRigid = 1e-6;

/// What is wrong with a body's transform, to be put behind whose it is; nullptr if nothing. Takes no memory.
inline const char* faultOf(const Eigen::Isometry3d& transform) {
  if (!transform.matrix().allFinite()) return "transform is not finite";
  const Eigen::Matrix3d rotation = transform.linear();
  const bool rigid = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= kRigid;
  return rigid && rotation.determinant() > 0 ? nullptr : "transform is not rigid: give a rotation and a shift";
}

}  // namespace hpsdf::physics
