#pragma once

#include <span>
#include <vector>

#include "contour/crossed_edges.h"
#include "contour/dual_mesh.h"
#include "contour/implicit_surface.h"
#include "hpsdf/error.h"

namespace hpsdf::contouring {

/// Returns for each triangle the greatest magnitude of the function in its middle and in the middles of its edges. If
/// the wall is left open, triangles that are not at the wall are measured against the function without it, too, because
/// the boundary of the mesh must lie on the surface.
std::vector<double> findTriangleErrors(const ImplicitSurface& surface, const DualMesh& mesh,
                                       std::span<const CrossedEdge> edges, bool isOpen, const Progress& progress);

}  // namespace hpsdf::contouring
