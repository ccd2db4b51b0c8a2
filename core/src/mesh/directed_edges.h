#pragma once

#include <array>
#include <cstddef>
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

/// Of sides by edge: calls visit(those of one edge) for each edge.
template <typename Visit>
void forEachEdge(std::span<const Side> sides, const Visit& visit) {
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    while (end < sides.size() && sides[end].edge == sides[begin].edge) ++end;
    visit(sides.subspan(begin, end - begin));
  }
}

}  // namespace hpsdf
