#pragma once

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::app {

/// A mesh without detail below `size` (0 or more, in the mesh's units), by vertex clustering (Rossignac and Borrel
/// 1993): vertices in one cube of that size become one, in their middle; triangles of which fewer than three corners
/// are left go. What is larger stays as it is, to the bit; a mesh without such detail is returned with the triangles
/// that it has.
TriangleMesh coarse(const TriangleMesh& mesh, double size);

}  // namespace hpsdf::app
