#include "mesh/directed_edges.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cstddef>
#include <utility>

namespace hpsdf::mesh {

std::vector<DirectedEdge> directedEdgesOf(std::span<const std::array<std::uint32_t, 3>> triangles) {
  std::vector<DirectedEdge> edges;
  edges.reserve(3 * triangles.size());
  for (std::size_t f = 0; f < triangles.size(); ++f)
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t from = triangles[f][i], to = triangles[f][(i + 1) % 3];
      if (from == to) continue;
      const auto [low, high] = std::minmax(from, to);
      edges.push_back({std::uint64_t{low} << 32 | high, static_cast<std::uint32_t>(f), from < to});
    }
  tbb::parallel_sort(edges.begin(), edges.end(), [](const DirectedEdge& a, const DirectedEdge& b) {
    return std::pair(a.edge, a.face) < std::pair(b.edge, b.face);
  });
  return edges;
}

}  // namespace hpsdf::mesh
