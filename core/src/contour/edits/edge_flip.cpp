#include "contour/edits/edge_flip.h"

#include <algorithm>

namespace hpsdf::contouring {

std::optional<std::uint32_t> neighborOf(const EditedMesh& mesh, std::uint32_t triangle, std::size_t side) {
  const Triangle& t = mesh.triangles()[triangle];
  const std::uint32_t a = t[side], b = t[(side + 1) % 3];
  std::optional<std::uint32_t> neighbor;
  for (const std::uint32_t n : mesh.trianglesAt(a)) {
    if (n == triangle || std::ranges::find(mesh.triangles()[n], b) == mesh.triangles()[n].end()) continue;
    if (neighbor) return std::nullopt;
    neighbor = n;
  }
  return neighbor;
}

std::optional<Edit> flipOf(const EditedMesh& mesh, std::uint32_t triangle, std::size_t side) {
  const Triangle& t = mesh.triangles()[triangle];
  const std::uint32_t a = t[side], b = t[(side + 1) % 3], c = t[(side + 2) % 3];
  const std::optional<std::uint32_t> neighbor = neighborOf(mesh, triangle, side);
  if (!neighbor) return std::nullopt;
  const Triangle& other = mesh.triangles()[*neighbor];
  const std::uint32_t d = *std::ranges::find_if(other, [&](std::uint32_t v) { return v != a && v != b; });
  for (const std::uint32_t n : mesh.trianglesAt(c))
    if (std::ranges::find(mesh.triangles()[n], d) != mesh.triangles()[n].end()) return std::nullopt;
  return Edit{.removed = {triangle, *neighbor}, .added = {{a, d, c}, {d, b, c}}, .vertex = {}};
}

}  // namespace hpsdf::contouring
