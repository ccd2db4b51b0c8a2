#pragma once

#include <span>

#include "contour/cells/crossed_edges.h"
#include "contour/cells/implicit_surface.h"
#include "contour/dual_mesh.h"
#include "hpsdf/error.h"

namespace hpsdf::contouring {

/// Measures the polygons that have changed: sets their error to the greatest magnitude of the function at the corners
/// of their triangles, in the middles of these and of their edges, and at more points of those whose error is not far
/// below the tolerance. If the wall is left open, polygons that are not at the wall are measured against the function
/// without it, too, because the boundary of the mesh must lie on the surface.
void measurePolygons(const ImplicitSurface& surface, const DualMesh& mesh, bool isOpen, double tolerance,
                     const Progress& progress, std::span<CrossedEdge> edges);

}  // namespace hpsdf::contouring
