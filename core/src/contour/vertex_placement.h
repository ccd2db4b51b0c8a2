#pragma once

#include <span>
#include <vector>

#include "contour/cells/contour_octree.h"
#include "contour/cells/crossed_edges.h"
#include "contour/cells/implicit_surface.h"
#include "contour/sheets.h"
#include "hpsdf/error.h"
#include "hpsdf/types.h"

namespace hpsdf::contouring {

/// Returns the middle of the points where a sheet crosses edges.
Vector3 middleOf(const Sheets& sheets, std::uint32_t sheet, std::span<const CrossedEdge> edges);

/// Places the vertices of chosen sheets: on the surface, strictly within the sheet's leaf, where the planes at the
/// sheet's crossings meet best. On a smooth part of the surface that is near the middle of the crossings, at a sharp
/// edge on the edge, at a corner on the corner. The function is at most `accuracy` there. `vertices` has an entry for
/// each sheet.
void placeVertices(const ImplicitSurface& surface, const ContourOctree& octree, std::span<const CrossedEdge> edges,
                   const Sheets& sheets, std::span<const std::uint32_t> chosen, double accuracy,
                   const Progress& progress, std::vector<Vector3>& vertices);

}  // namespace hpsdf::contouring
