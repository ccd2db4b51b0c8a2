#pragma once

#include <cmath>

#include "hpsdf/types.h"

namespace hpsdf {

/// Whether the sign of this volume, of a surface of this area and box, tells inside from outside. Of a closed one it is
/// a fact. Of an open one the volume depends on the apex chosen, so that a nearly flat sheet would be turned by chance:
/// it is believed only where it is at least a hundredth of its box, as of a solid with some holes, and more than the
/// rounding of a sum of such areas.
inline bool isPlain(double volume, double area, const Box& box, bool closed) {
  const Vector3 size = box.sizes();
  return closed || (std::abs(volume) > 0.01 * size.prod() && std::abs(volume) > 1e-9 * area * size.norm());
}

/// Whether a surface of this signed volume, area and box looks inwards.
inline bool looksInward(double volume, double area, const Box& box, bool closed) {
  return volume < 0 && isPlain(volume, area, box, closed);
}

}  // namespace hpsdf
