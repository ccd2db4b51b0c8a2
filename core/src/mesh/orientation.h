#pragma once

#include <cmath>

#include "hpsdf/types.h"

namespace hpsdf::mesh {

/// Returns true if the sign of `volume` reliably tells whether the faces of a surface are oriented outward.
/// `area` and `box` are those of the surface.
///
/// The volume of a closed surface is well defined. The volume of an open surface depends on the chosen
/// apex, so that a nearly flat sheet would be reversed by chance. The volume of an open surface is
/// therefore trusted only if it is at least a hundredth of the box's volume, as for a solid with some
/// holes, and exceeds the rounding error of its summation.
inline bool hasReliableVolumeSign(double volume, double area, const Box& box, bool closed) {
  const Vector3 size = box.sizes();
  return closed || (std::abs(volume) > 0.01 * size.prod() && std::abs(volume) > 1e-9 * area * size.norm());
}

}  // namespace hpsdf::mesh
