#pragma once

#include <span>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

/// Triangulates a simple, nearly flat polygon of n corners into n - 2 triangles with the polygon's orientation. The
/// triangles consist of indices into `polygon`. Where the polygon allows it, even the triangles at corners along a
/// straight side have an area above 0. Polygons that intersect themselves, or whose corners crowd in a small part
/// of them, take time quadratic in n. Throws `Cancelled` when `progress` says so.
std::vector<Triangle> triangulate(std::span<const Vector3> polygon, const Progress& progress = {});

}  // namespace hpsdf::mesh
