#pragma once

#include <filesystem>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

/// All meshes of the file's scene joined under their node transforms, with polygons triangulated and nothing cleaned.
/// Throws `Error` as `importMesh` does.
TriangleMesh readByAssimp(const std::filesystem::path& file);

/// Returns true for a file that can hold coordinates with more digits than the `float` of assimp's readers.
bool mayExceedFloat(const std::filesystem::path& file);

}  // namespace hpsdf::mesh
