#pragma once

#include <filesystem>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

/// Reads all meshes of a file's scene with assimp and joins them under their node transforms. Polygons are
/// triangulated, and nothing is cleaned. Throws `Error` in the same cases as `importMesh`.
TriangleMesh readByAssimp(const std::filesystem::path& file);

/// Returns true for a file that can hold coordinates with more digits than the `float` of assimp's readers.
bool mayExceedFloat(const std::filesystem::path& file);

}  // namespace hpsdf::mesh
