#pragma once

#include <cstdint>

namespace hpsdf::query {

/// `keepInOctant` may write so many numbers at once, and so beyond `count`.
inline constexpr std::uint32_t kFilterWidth = 16;

/// Keeps those of `count` triangles whose byte in `octants` has the bit of this octant, in their order, by SIMD.
/// Returns their number. `triangles` must have room for `kFilterWidth` more numbers, whose values do not matter.
std::uint32_t keepInOctant(const std::uint8_t* octants, int octant, std::uint32_t* triangles, std::uint32_t count);

}  // namespace hpsdf::query
