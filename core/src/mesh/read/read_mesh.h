#pragma once

#include <filesystem>

#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

/// Reads a mesh file of any known format; its extension tells the format. Polygons are triangulated; degenerate and
/// duplicate triangles remain. Throws `Error` in the same cases as `importMesh`.
TriangleMesh readMesh(const std::filesystem::path& file, const Progress& progress);

/// Returns true if a file has the extension of a format that `readMesh` reads.
bool hasMeshExtension(const std::filesystem::path& file);

/// Returns true if the libraries assimp or Draco read the file or parts of it (see `hpsdf::isReadByOthers`).
bool isReadByOthers(const std::filesystem::path& file);

}  // namespace hpsdf::mesh
