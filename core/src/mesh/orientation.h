#pragma once

#include <cmath>

#include "hpsdf/types.h"

namespace hpsdf::mesh {

/// Returns true if the sign of a surface's signed volume reliably tells whether its faces are oriented outward.
/// `volume` is the sum of the signed volumes of the tetrahedra between the faces and an apex, and `box` is the
/// surface's bounding box.
///
/// For an open surface the volume depends on the apex, so that its sign is arbitrary for a nearly flat sheet. The
/// sign of an open surface's volume is therefore trusted only if the volume is at least a hundredth of the box's
/// volume, as for a solid with some holes, and exceeds the rounding error of the sum.
inline bool hasReliableVolumeSign(double volume, double area, const Box& box, bool closed) {
  const Vector3 size = box.sizes();
  return closed || (std::abs(volume) > 0.01 * size.prod() && std::abs(volume) > 1e-9 * area * size.norm());
}

}  // namespace hpsdf::mesh
