#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

/// Triangulates a simple, nearly flat polygon of n corners into n - 2 triangles, as indices into `polygon` and with its
/// orientation. Corners along a straight side get triangles with an area where the polygon allows it.
///
/// assimp 5.2 has a triangulation of its own, whose triangles extend beyond concave polygons.
std::vector<Triangle> triangulate(std::span<const Vector3> polygon);

}  // namespace hpsdf::mesh
