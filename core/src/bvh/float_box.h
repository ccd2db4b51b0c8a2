#pragma once

#include <Eigen/Core>
#include <limits>

namespace hpsdf::bvh {

/// Axis-aligned box of points with four lanes, the fourth of which is unused. A new box is empty.
struct FloatBox {
  Eigen::Array4f lower = Eigen::Array4f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Array4f upper = Eigen::Array4f::Constant(-std::numeric_limits<float>::infinity());

  void extend(const FloatBox& other) {
    lower = lower.min(other.lower);
    upper = upper.max(other.upper);
  }
  void extend(const Eigen::Array4f& point) {
    lower = lower.min(point);
    upper = upper.max(point);
  }
  /// Half of the surface area, as the surface-area heuristic needs it.
  float area() const {
    const Eigen::Array4f size = upper - lower;
    return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
  }
};

}  // namespace hpsdf::bvh
