#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "bvh/hierarchy.h"
#include "hpsdf/error.h"
#include "hpsdf/mesh_report.h"

namespace hpsdf::surface {

/// The positions of the corners of a triangle.
using Corners = std::array<Vector3, 3>;

/// Returns true if two triangles have a point in common, decided exactly. Their coordinates must be of order 1.
bool intersect(const Corners& one, const Corners& other);

/// Returns true if an edge of the coplanar triangle `other`, among those that `counts` selects, intersects the triangle
/// `one`. Both are projected along the axis from which `other` shows the most area.
bool edgesIntersect(const Corners& one, const Corners& other, const std::array<bool, 3>& counts);

/// Returns true if two triangles are coplanar, up to rounding. Their coordinates must be of order 1.
bool areCoplanar(const Corners& one, const Corners& other);

/// Returns a factor that scales coordinates to order 1. It is a power of two, so that scaling is exact.
double scaleToOne(std::span<const Vector3> vertices);

/// Finds the crossings of a hierarchy's triangles like `hpsdf::findCrossings`, with indices in the mesh. If `margin`,
/// in coordinates of order 1, is above 0, pairs of triangles that are nearer than it count as crossings too; this is
/// decided with rounding.
Crossings findCrossings(const bvh::Hierarchy& hierarchy, std::size_t limit, double margin, const Progress& progress);

}  // namespace hpsdf::surface
