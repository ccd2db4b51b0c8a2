#include "simulate/coarse_mesh.h"

#include <array>
#include <cmath>
#include <map>

namespace hpsdf::app {

TriangleMesh coarse(const TriangleMesh& mesh, double size) {
  if (!(size > 0)) return mesh;
  TriangleMesh result{.vertices = {}, .triangles = {}, .name = mesh.name};
  std::map<std::array<double, 3>, std::uint32_t> known;  // cubes that contain vertices, and their numbers
  std::vector<std::uint32_t> cubes;                      // number of the cube of each vertex
  std::vector<double> members;                           // number of vertices in each cube
  for (const Vector3& x : mesh.vertices) {
    const std::array<double, 3> cube = {std::floor(x.x() / size), std::floor(x.y() / size), std::floor(x.z() / size)};
    const auto [found, isNew] = known.try_emplace(cube, std::uint32_t(known.size()));
    if (isNew) {
      result.vertices.push_back(Vector3::Zero());
      members.push_back(0);
    }
    cubes.push_back(found->second);
    result.vertices[cubes.back()] += x;
    ++members[cubes.back()];
  }
  for (std::size_t cube = 0; cube < members.size(); ++cube) result.vertices[cube] /= members[cube];
  for (const auto& [a, b, c] : mesh.triangles)
    if (cubes[a] != cubes[b] && cubes[b] != cubes[c] && cubes[c] != cubes[a])
      result.triangles.push_back({cubes[a], cubes[b], cubes[c]});
  return result.triangles.empty() ? mesh : result;
}

}  // namespace hpsdf::app
