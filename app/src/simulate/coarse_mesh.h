#pragma once

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::app {

/// Removes details smaller than `size` (0 or more, in the mesh's units) by vertex clustering (Rossignac and
/// Borrel 1993). Space is divided into cubes with edges of length `size`. The vertices within one cube are
/// merged into their mean, and triangles with fewer than three different corners are removed. A vertex that
/// is alone in its cube keeps its coordinates exactly. If the mesh would lose all its triangles, it is
/// returned unchanged.
TriangleMesh coarse(const TriangleMesh& mesh, double size);

}  // namespace hpsdf::app
