#pragma once

#include <random>

#include "hpsdf/types.h"

namespace hpsdf::physics {

/// Returns a random rotation with a random shift of up to `reach` along each axis.
inline Eigen::Isometry3d randomPose(std::mt19937_64& random, double reach) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> shift(-reach, reach);
  Eigen::Quaterniond rotation(normal(random), normal(random), normal(random), normal(random));
  Eigen::Isometry3d pose(rotation.normalized());
  for (double& x : pose.translation()) x = shift(random);
  return pose;
}

}  // namespace hpsdf::physics
