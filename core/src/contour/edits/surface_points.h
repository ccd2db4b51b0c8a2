#pragma once

#include <span>
#include <vector>

#include "contour/cells/implicit_surface.h"
#include "contour/edits/edit_limits.h"
#include "contour/edits/edited_mesh.h"
#include "hpsdf/error.h"

namespace hpsdf::contouring {

/// Returns points of the surface near triangles, which are given by their corners: some for each, within the tolerance
/// of it. `triangle` of a point is the place of its triangle among these.
std::vector<SurfacePoint> surfacePointsNear(const ImplicitSurface& surface, const EditLimits& limits,
                                            std::span<const Corners> triangles);

/// Returns the vertices of a mesh, and points of the surface near its triangles.
std::vector<SurfacePoint> surfacePointsOf(const ImplicitSurface& surface, const EditLimits& limits,
                                          const Progress& progress, const EditedMesh& mesh);

}  // namespace hpsdf::contouring
