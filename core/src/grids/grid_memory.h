#pragma once

#include <sstream>

#include "hpsdf/detail/memory.h"

namespace hpsdf::grids {

/// Throws `Error` (of the kind `limit`) if a grid with these numbers of points along x, y and z would not fit into
/// memory, at `bytesOfPoint` bytes a point. The numbers may be greater than an integer can hold.
inline void requireGridMemory(double x, double y, double z, double bytesOfPoint) {
  std::ostringstream what;
  what << "a grid of " << x << " x " << y << " x " << z << " points";
  requireMemory(what.str(), x * y * z * bytesOfPoint, "give larger voxels or fewer cells");
}

}  // namespace hpsdf::grids
