#pragma once

#include <algorithm>

#include "hpsdf/types.h"

namespace hpsdf::bvh {

/// The point of segment ab closest to x, as its parameter in [0, 1] from a to b; 0 where a = b.
inline double closestParameter(const Vector3& x, const Vector3& a, const Vector3& b) {
  const Vector3 direction = b - a;
  const double squaredLength = direction.squaredNorm();
  return squaredLength > 0 ? std::clamp((x - a).dot(direction) / squaredLength, 0.0, 1.0) : 0.0;
}

}  // namespace hpsdf::bvh
