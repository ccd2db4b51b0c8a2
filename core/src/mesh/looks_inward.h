#pragma once

#include "hpsdf/types.h"

namespace hpsdf {

/// Whether a surface of this signed volume, area and box looks inwards. Of a closed one the sign of the volume is a
/// fact. Of an open one the volume depends on the apex chosen, so that a nearly flat sheet would be turned by chance:
/// it is believed only where it is at least a hundredth of its box, as of a solid with some holes, and more than the
/// rounding of a sum of such areas.
inline bool looksInward(double volume, double area, const Box& box, bool closed) {
  if (volume >= 0) return false;
  if (closed) return true;
  const Vector3 size = box.sizes();
  return -volume > 0.01 * size.prod() && -volume > 1e-9 * area * size.norm();
}

}  // namespace hpsdf
