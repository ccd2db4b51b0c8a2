#pragma once
// Faces whose three corners lie on one line.

#include <array>
#include <cstddef>
#include <cstdint>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// Whether a triangle's corners lie on one line, up to the rounding of this very test. The bound is relative to the
/// edges, so that the size of the mesh does not matter and a thin sliver with an area is kept.
bool hasNoArea(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle);

/// A face on one line whose middle corner touches the edge of just one neighbour is needed to keep the mesh closed:
/// n-gons and CAD facets with corners along a straight side bring such faces. Flips the edge that the two share, which
/// splits the neighbour at the middle corner: the same surface, the same count of faces, all with an area.
/// Returns the number of flips. Faces where that is impossible are left as they are.
std::size_t flipCollinearFaces(TriangleMesh& mesh);

}  // namespace hpsdf
