#pragma once

#include <filesystem>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// Writes a mesh as OBJ or binary PLY, by the file's extension, coordinates in double to the last digit. (PLY as text
/// where its data would begin with the byte of a line feed, which `importMesh` could not read.) The file appears whole
/// or not at all. Throws `Error` for another extension, and as `OutputFile` does.
void saveMesh(const TriangleMesh& mesh, const std::filesystem::path& file);

/// Throws what `saveMesh` would for the file's name, as far as it can be told beforehand: before long work.
void checkMeshWritable(const std::filesystem::path& file);

}  // namespace hpsdf
