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
/// One stays of those that look the same way, unless bodies share them: then all without which along fewer edges as
/// many sides would run one way as the other. What is given once more besides is dropped, from its outline inwards.
/// Where they look both ways, they are
/// - the wall between two bodies that touch, where the faces around them hold each other's edges without them: one each
///   way stays, so that each body is closed;
/// - otherwise a surface given with both its sides, as programs for drawing do: one stays that looks the way of most,
///   the first where these are as many.
/// What hangs together by edges is one or the other.
std::vector<char> superfluousFaces(std::span<const std::array<std::uint32_t, 3>> triangles);

}  // namespace hpsdf
