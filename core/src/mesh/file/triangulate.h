#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

/// Triangulates a simple, nearly flat polygon of n corners into n - 2 triangles with the polygon's orientation. The
/// triangles consist of indices into `polygon`. Where the polygon allows it, even the triangles at corners along a
/// straight side have an area above 0.
///
/// The triangulation in assimp 5.2 is not used, because its triangles extend beyond concave polygons.
std::vector<Triangle> triangulate(std::span<const Vector3> polygon);

}  // namespace hpsdf::mesh
