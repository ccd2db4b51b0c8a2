#pragma once
// Triangles whose three corners lie on one line.

#include <array>
#include <cstddef>
#include <cstdint>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

/// Returns true if a triangle's corners lie on one line up to the rounding of this test. The tolerance is relative to
/// the edges, so that it does not depend on the size of the mesh and keeps thin slivers with an area.
bool hasNoArea(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle);

/// Flips the longest edge of collinear triangles and returns the number of flips.
///
/// Polygons and CAD facets with corners along a straight side yield such triangles, and dropping them would open the
/// mesh. A flip splits the neighbour across the longest edge at the middle corner: surface and number of triangles
/// stay, and both triangles have an area. Where that is impossible the triangle stays as it is.
std::size_t flipCollinearFaces(TriangleMesh& mesh);

}  // namespace hpsdf::mesh
