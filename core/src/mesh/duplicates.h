#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hpsdf {

/// Over the same corners, whichever way they look.
bool areTwins(const std::array<std::uint32_t, 3>& one, const std::array<std::uint32_t, 3>& other);

/// Which of the faces over the same corners are too many, of each 1.
///
/// One stays of those that look the same way, and, looking the way of most, of those that do not. Where as many look
/// one way as the other, they are
/// - the wall between two bodies that touch, where the faces around them hold each other's edges without them: one each
///   way stays, so that each body is closed;
/// - otherwise a surface given with both its sides, as programs for drawing do: the first stays.
/// What hangs together by edges is one or the other.
std::vector<char> superfluousFaces(std::span<const std::array<std::uint32_t, 3>> triangles);

}  // namespace hpsdf
