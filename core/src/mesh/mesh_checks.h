#pragma once
// Private to the mesh room: how its messages name a mesh, and the checks that more than one file makes.

#include <string>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// "NAME: " before a message, or "mesh: " for a mesh without a name.
inline std::string messagePrefix(const TriangleMesh& mesh) { return (mesh.name.empty() ? "mesh" : mesh.name) + ": "; }

/// Throws `Error` for the first triangle that refers to a vertex which does not exist.
void requireValidIndices(const TriangleMesh& mesh);

}  // namespace hpsdf
