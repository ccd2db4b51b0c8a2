#pragma once

#include <vector>

#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf::contouring {

/// Removes triangles from a mesh, and vertices that no triangle uses. `isKept` tells which triangles stay. Where those
/// that are removed held fans of triangles together, each fan gets a vertex of its own.
void removeTriangles(const std::vector<bool>& isKept, std::vector<Vector3>& vertices, std::vector<Triangle>& triangles);

}  // namespace hpsdf::contouring
