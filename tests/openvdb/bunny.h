#pragma once

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
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

inline double rmsDifference(const std::vector<double>& a, const std::vector<double>& b) {
  double squares = 0;
  for (std::size_t n = 0; n < a.size(); ++n) squares += (a[n] - b[n]) * (a[n] - b[n]);
  return std::sqrt(squares / double(a.size()));
}

}  // namespace hpsdf
