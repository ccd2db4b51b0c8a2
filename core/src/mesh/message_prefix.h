#pragma once
// Private to core: how its messages name a mesh.

#include <string>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// "NAME: " before a message, or "mesh: " for a mesh without a name.
inline std::string messagePrefix(const TriangleMesh& mesh) { return (mesh.name.empty() ? "mesh" : mesh.name) + ": "; }

}  // namespace hpsdf
