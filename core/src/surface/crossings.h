#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "bvh/hierarchy.h"
#include "hpsdf/error.h"
#include "hpsdf/mesh_report.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::surface {

/// The positions of the corners of a triangle.
using Corners = std::array<Vector3, 3>;

/// Returns true if two triangles have a point in common. The test is exact for coordinates with magnitudes of about 1.
bool intersect(const Corners& one, const Corners& other);

/// Returns true if an edge of the triangle `other` intersects the coplanar triangle `one`. Only edges k of
/// `other` with counts[k] = true are tested. Both triangles are projected along the coordinate axis along which
/// the projection of `other` has the greatest area.
bool edgesIntersect(const Corners& one, const Corners& other, const std::array<bool, 3>& counts);

/// Returns true if two triangles are coplanar, up to rounding. The magnitude of their coordinates must be about 1.
bool areCoplanar(const Corners& one, const Corners& other);

/// Returns a factor that scales coordinates to a magnitude of about 1. The factor is a power of two, so
/// that scaling is exact.
double scaleToOne(std::span<const Vector3> vertices);

/// Finds at most `limit` pairs of intersecting triangles in a hierarchy, as `hpsdf::findCrossings` does, and
/// returns them with the triangles' indices in the mesh. If `margin` is above 0, triangles nearer to each other
/// than `margin` count too, up to rounding. `margin` is in coordinates scaled by `scaleToOne`.
Crossings findCrossings(const bvh::Hierarchy& hierarchy, std::size_t limit, double margin, const Progress& progress);

/// Finds at most `limit` crossings of the chosen triangles of a mesh with each other and with the others, as
/// `hpsdf::findCrossings` does. `chosen` has one entry for each triangle.
Crossings findCrossingsOf(const TriangleMesh& mesh, const std::vector<bool>& chosen, std::size_t limit,
                          const Progress& progress);

}  // namespace hpsdf::surface
