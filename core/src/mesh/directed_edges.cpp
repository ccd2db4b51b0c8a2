#include "mesh/directed_edges.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cstddef>
#include <utility>

namespace hpsdf {

std::vector<Side> sidesByEdge(std::span<const std::array<std::uint32_t, 3>> triangles) {
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (std::size_t f = 0; f < triangles.size(); ++f)
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t from = triangles[f][i];
      const std::uint32_t to = triangles[f][(i + 1) % 3];
      if (from == to) continue;  // of a degenerate face: no edge
      const auto [low, high] = std::minmax(from, to);
      sides.push_back({std::uint64_t{low} << 32 | high, static_cast<std::uint32_t>(f), from < to});
    }
  tbb::parallel_sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::pair(a.edge, a.face) < std::pair(b.edge, b.face);
  });
  return sides;
}

}  // namespace hpsdf
