#pragma once

#include "hpsdf/triangle_mesh.h"
#include "mesh/scan/input.h"

namespace hpsdf::mesh {

/// Reads all meshes of a 3DS file with the library assimp, transforms them by their scene nodes and joins them into one
/// mesh. assimp keeps coordinates as `float`. A damaged file can crash it, or keep it busy for minutes: read untrusted
/// files in a process of their own. Throws `Error` if assimp cannot read the file.
TriangleMesh readByAssimp(Input& input);

}  // namespace hpsdf::mesh
