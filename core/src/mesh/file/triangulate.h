#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf {

/// Triangles over the corners of a simple, nearly flat polygon, as indices into `polygon` and with its orientation:
/// always two fewer than corners. Corners along a straight side get triangles with an area where the polygon allows
/// it. (Ours, because assimp 5.2 lets triangles reach outside of concave polygons, and Debian packages no library.)
std::vector<std::array<std::uint32_t, 3>> triangulate(std::span<const Vector3> polygon);

}  // namespace hpsdf
