#include "contour/open_mesh.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>

#include "mesh/connectivity.h"

namespace hpsdf::contouring {

void removeTriangles(const std::vector<bool>& isKept, std::vector<Vector3>& vertices,
                     std::vector<Triangle>& triangles) {
  std::vector<Triangle> kept;
  for (std::size_t i = 0; i < triangles.size(); ++i)
    if (isKept[i]) kept.push_back(triangles[i]);

  // The corners of triangles, three for each, are united across edges that two triangles share.
  mesh::DisjointSets corners(3 * kept.size());
  const auto cornerAt = [&](std::uint32_t triangle, std::uint32_t vertex) {
    const auto place = std::ranges::find(kept[triangle], vertex) - kept[triangle].begin();
    return 3 * triangle + static_cast<std::uint32_t>(place);
  };
  const std::vector<mesh::DirectedEdge> sides = mesh::directedEdgesOf(kept);
  mesh::forEachEdge(sides, [&](std::span<const mesh::DirectedEdge> side) {
    for (std::size_t i = 1; i < side.size(); ++i)
      for (const std::uint32_t end : {side[0].low(), side[0].high()})
        corners.join(cornerAt(side[0].face, end), cornerAt(side[i].face, end));
  });
  std::vector<std::uint32_t> number(3 * kept.size());
  std::vector<Vector3> used;
  for (std::uint32_t corner = 0; corner < number.size(); ++corner) {
    std::uint32_t& vertex = kept[corner / 3][corner % 3];
    if (corners.first(corner) == corner) {
      number[corner] = static_cast<std::uint32_t>(used.size());
      used.push_back(vertices[vertex]);
    }
    vertex = number[corners.first(corner)];
  }
  vertices = std::move(used);
  triangles = std::move(kept);
}

}  // namespace hpsdf::contouring
