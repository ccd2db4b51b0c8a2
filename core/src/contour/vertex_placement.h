#pragma once

#include <span>
#include <vector>

#include "contour/contour_octree.h"
#include "contour/crossed_edges.h"
#include "contour/implicit_surface.h"
#include "contour/sheets.h"
#include "hpsdf/error.h"
#include "hpsdf/types.h"

namespace hpsdf::contouring {

/// Returns the middle of the points where a sheet crosses edges.
Vector3 middleOf(const Sheets& sheets, std::uint32_t sheet, std::span<const CrossedEdge> edges);

/// Places one vertex for each sheet: on the surface, strictly within the sheet's leaf, where the planes at the sheet's
/// crossings meet best. On a smooth part of the surface that is near the middle of the crossings, at a sharp edge on
/// the edge, at a corner on the corner. Vertices are moved until the function is at most `accuracy` there, as far as
/// the leaf allows.
std::vector<Vector3> placeVertices(const ImplicitSurface& surface, const ContourOctree& octree,
                                   std::span<const CrossedEdge> edges, const Sheets& sheets, double accuracy,
                                   const Progress& progress);

}  // namespace hpsdf::contouring
