#pragma once

#include <filesystem>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

/// Reads all meshes of a file with assimp, transforms them by their scene nodes and joins them into one mesh. Polygons
/// are triangulated; degenerate and duplicate triangles remain. Throws `Error` in the same cases as `importMesh`.
TriangleMesh readByAssimp(const std::filesystem::path& file);

/// Returns true if a file has the extension of a format that `readByAssimp` reads.
bool hasKnownExtension(const std::filesystem::path& file);

/// Returns true if a file can hold coordinates with more digits than the `float` numbers into which assimp reads them.
bool mayExceedFloat(const std::filesystem::path& file);

}  // namespace hpsdf::mesh
