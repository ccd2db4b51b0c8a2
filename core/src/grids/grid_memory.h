#pragma once

#include <cstdint>
#include <sstream>
#include <string>
#include <string_view>

#include "hpsdf/detail/memory.h"
#include "util/refuse.h"

namespace hpsdf::grids {

/// The advice for grids of other programs that do not fit into memory.
constexpr std::string_view kCoarserGrid = "take a grid with larger voxels";

/// Returns "a grid of X x Y x Z points" with whole numbers, which may be greater than an integer can hold.
inline std::string gridText(double x, double y, double z) {
  std::ostringstream text;
  text.precision(20);
  text << "a grid of " << x << " x " << y << " x " << z << " points";
  return text.str();
}

/// Throws `Error` (of the kind `limit`) if a grid with these numbers of points along x, y and z would not fit into
/// memory, at `bytesOfPoint` bytes a point. The numbers may be greater than an integer can hold. The message ends with
/// `advice`.
inline void requireGridMemory(double x, double y, double z, double bytesOfPoint,
                              std::string_view advice = "give larger voxels or fewer cells") {
  requireMemory(gridText(x, y, z), x * y * z * bytesOfPoint, advice);
}

/// The greatest number of points along an axis of a grid that is read: distances find samples by 24-bit indices.
constexpr std::uint64_t kMostPointsOfAxis = std::uint64_t{1} << 23;

/// Throws `Error` if a grid that is to be read has no points or too many along an axis, or if it would not fit into
/// memory at `bytesOfPoint` bytes a point.
inline void requireReadableGrid(double x, double y, double z, double bytesOfPoint) {
  for (const double points : {x, y, z})
    if (!(points >= 1 && points <= double(kMostPointsOfAxis)))
      detail::refuse(gridText(x, y, z), "; expected from 1 to ", kMostPointsOfAxis, " points along each axis");
  requireGridMemory(x, y, z, bytesOfPoint, kCoarserGrid);
}

}  // namespace hpsdf::grids
