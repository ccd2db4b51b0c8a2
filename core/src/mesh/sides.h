#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hpsdf {

/// One triangle's side, filed under its undirected edge.
struct Side {
  std::uint64_t edge;  ///< lower vertex in the high half, higher vertex in the low half
  std::uint32_t face;
  bool rising;  ///< runs from the lower to the higher vertex

  std::uint32_t low() const { return static_cast<std::uint32_t>(edge >> 32); }
  std::uint32_t high() const { return static_cast<std::uint32_t>(edge); }
};

/// All sides but those between equal vertices, those of one edge side by side, by their faces.
std::vector<Side> sidesByEdge(std::span<const std::array<std::uint32_t, 3>> triangles);

}  // namespace hpsdf
