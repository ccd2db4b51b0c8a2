#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "contour/cells/contour_octree.h"
#include "contour/cells/crossed_edges.h"
#include "contour/cells/implicit_surface.h"
#include "contour/dual_mesh.h"
#include "contour/sheets.h"
#include "hpsdf/error.h"

namespace hpsdf::contouring {

struct GapLimits {
  double tolerance;  ///< more points are searched where the gap is not far below it, and none where it is above
  double accuracy;   ///< greatest distance of points of the surface from it
};

/// Measures the mesh from the surface: finds points of the surface in each leaf with sheets, and their distances to the
/// triangles around the leaf's crossed edges. Middles of triangles do not see a notch that the mesh bridges; these
/// points do. Sets `gaps`, by leaf, to the greatest distances; entries that are not negative are known already.
void findSurfaceGaps(const ImplicitSurface& surface, const ContourOctree& octree, std::span<const CrossedEdge> edges,
                     const Sheets& sheets, const DualMesh& mesh, const GapLimits& limits, const Progress& progress,
                     std::vector<double>& gaps);

}  // namespace hpsdf::contouring
