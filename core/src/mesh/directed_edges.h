#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hpsdf::mesh {

/// One edge of one triangle, with its direction.
struct DirectedEdge {
  std::uint64_t edge;  ///< key of the undirected edge: lower vertex in the high half, higher vertex in the low half
  std::uint32_t face;  ///< index of the triangle
  bool rising;         ///< the direction is from the lower to the higher vertex

  std::uint32_t low() const { return static_cast<std::uint32_t>(edge >> 32); }
  std::uint32_t high() const { return static_cast<std::uint32_t>(edge); }
};

/// The directed edges of all triangles, sorted by undirected edge and then by face. Edges between equal vertices are
/// left out.
std::vector<DirectedEdge> directedEdgesOf(std::span<const std::array<std::uint32_t, 3>> triangles);

/// Calls visit(directed edges of one undirected edge) for each undirected edge of a list that is sorted by edge.
template <typename Visit>
void forEachEdge(std::span<const DirectedEdge> edges, const Visit& visit) {
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end].edge == edges[begin].edge) ++end;
    visit(edges.subspan(begin, end - begin));
  }
}

}  // namespace hpsdf::mesh
