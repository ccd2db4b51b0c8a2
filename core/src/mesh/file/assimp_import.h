#pragma once
// Mesh files as assimp reads them.

#include <filesystem>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// All meshes of the file's scene joined under their node transforms, n-gons triangulated, nothing cleaned. Throws
/// `Error` as `importMesh` does.
TriangleMesh readByAssimp(const std::filesystem::path& file);

bool saysMoreThanFloat(const std::filesystem::path& file);

}  // namespace hpsdf
