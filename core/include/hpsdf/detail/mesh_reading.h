#pragma once
// What the program needs to have a mesh file read by a process of its own.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::detail {

/// Returns true if the library assimp reads files of this name. A damaged file can crash it.
bool isReadByAssimp(const std::filesystem::path& file);

/// Reads a mesh file as `importMesh` does, but does not clean the mesh. The mesh has the name `file`.
TriangleMesh readMesh(const std::filesystem::path& file, const Progress& progress = {});

/// Reads a mesh from the bytes of a PLY file, and does not clean it. `name` names it in errors.
TriangleMesh readPly(std::string_view bytes, const std::string& name, const Progress& progress = {});

/// Passes the bytes of a binary PLY file with this mesh to `write`, in pieces. Allocates less than 100 kB.
void writePly(const TriangleMesh& mesh, const std::function<void(std::span<const std::byte>)>& write);

}  // namespace hpsdf::detail
