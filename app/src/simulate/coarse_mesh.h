#pragma once

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::app {

/// Removes detail below `size` (0 or more, in the mesh's units) by vertex clustering (Rossignac and Borrel 1993): the
/// vertices within one cube of that size are merged into their mean, and triangles with fewer than three different
/// corners are removed. A vertex that is alone in its cube keeps its coordinates to the bit. A mesh that would lose all
/// its triangles is returned as it is.
TriangleMesh coarse(const TriangleMesh& mesh, double size);

}  // namespace hpsdf::app
