#include "simulate/coarse_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace hpsdf::app {
namespace {

/// The index of each vertex's cube. Cubes are numbered in the order of their first vertices.
std::vector<std::uint32_t> cubesOf(const std::vector<Vector3>& vertices, double size) {
  std::map<std::array<double, 3>, std::uint32_t> known;
  std::vector<std::uint32_t> cubes;
  cubes.reserve(vertices.size());
  for (const Vector3& x : vertices) {
    const std::array<double, 3> cube = {std::floor(x.x() / size), std::floor(x.y() / size), std::floor(x.z() / size)};
    cubes.push_back(known.try_emplace(cube, std::uint32_t(known.size())).first->second);
  }
  return cubes;
}

/// The mean of the vertices in each cube.
std::vector<Vector3> cubeMeans(const std::vector<Vector3>& vertices, const std::vector<std::uint32_t>& cubes) {
  const std::size_t count = cubes.empty() ? 0 : *std::ranges::max_element(cubes) + std::size_t{1};
  std::vector<Vector3> sums(count, Vector3::Zero());
  std::vector<double> members(count, 0);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    sums[cubes[v]] += vertices[v];
    ++members[cubes[v]];
  }
  for (std::size_t cube = 0; cube < count; ++cube) sums[cube] /= members[cube];
  return sums;
}

}  // namespace

TriangleMesh coarse(const TriangleMesh& mesh, double size) {
  if (!(size > 0)) return mesh;
  const std::vector<std::uint32_t> cubes = cubesOf(mesh.vertices, size);
  TriangleMesh result{.vertices = cubeMeans(mesh.vertices, cubes), .triangles = {}, .name = mesh.name};
  for (const auto& [a, b, c] : mesh.triangles)
    if (cubes[a] != cubes[b] && cubes[b] != cubes[c] && cubes[c] != cubes[a])
      result.triangles.push_back({cubes[a], cubes[b], cubes[c]});
  return result.triangles.empty() ? mesh : result;
}

}  // namespace hpsdf::app
