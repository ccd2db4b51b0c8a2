#pragma once

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <random>
#include <vector>

#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/types.h"

namespace hpsdf {

constexpr double kBunnyVoxel = 2.0 / 256;  ///< a 256th of the normalized bunny's longest side

/// Returns the normalized bunny of the folder HPSDF_MESHES, or nothing if that is not set.
inline std::optional<TriangleMesh> bunnyMesh() {
  const char* folder = std::getenv("HPSDF_MESHES");
  if (folder == nullptr) return std::nullopt;
  return normalized(importMesh(std::filesystem::path(folder) / "paper/bunny_69k.obj").mesh);
}

inline Box bunnyDomain() { return Box(Vector3::Constant(-1.1), Vector3::Constant(1.1)); }

/// Returns points within `reach` of the surface, uniformly distributed in surface area and in height.
inline std::vector<Vector3> pointsNear(const TriangleMesh& mesh, std::size_t count, double reach) {
  std::vector<double> areas;
  std::vector<Vector3> normals;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3 normal = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    areas.push_back(normal.norm());
    normals.push_back(normal.normalized());
  }
  std::mt19937_64 random(2016);
  std::discrete_distribution<std::size_t> byArea(areas.begin(), areas.end());
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Vector3> points(count);
  for (Vector3& x : points) {
    const std::size_t triangle = byArea(random);
    const auto& [a, b, c] = mesh.triangles[triangle];
    const double toCorner = std::sqrt(uniform(random)), alongSide = uniform(random);
    x = (1 - toCorner) * mesh.vertices[a] + toCorner * (1 - alongSide) * mesh.vertices[b] +
        toCorner * alongSide * mesh.vertices[c] + reach * (2 * uniform(random) - 1) * normals[triangle];
  }
  return points;
}

inline double rmsDifference(const std::vector<double>& a, const std::vector<double>& b) {
  double squares = 0;
  for (std::size_t n = 0; n < a.size(); ++n) squares += (a[n] - b[n]) * (a[n] - b[n]);
  return std::sqrt(squares / double(a.size()));
}

}  // namespace hpsdf
