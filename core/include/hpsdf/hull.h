#pragma once

#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// What of a mesh counts as surface to `Sign::hull`: its triangles without those, or the pieces of those, that have the
/// inside on both sides. What is left of a triangle that was cut has vertices of its own. Throws `Error` as
/// `ExactDistance` does.
TriangleMesh hull(const TriangleMesh& mesh);

}  // namespace hpsdf
