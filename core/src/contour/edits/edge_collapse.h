#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "contour/cells/implicit_surface.h"
#include "contour/cells/meeting_point.h"
#include "contour/edits/edited_mesh.h"
#include "contour/edits/mesh_editor.h"

namespace hpsdf::contouring {

/// A place for the vertex into which the ends of an edge are merged.
struct MergedVertex {
  Vector3 position;
  double cost;  ///< greatest distance of the position from the planes of the triangles at both ends
};

/// Returns the point that fits the planes of the triangles at both ends of an edge best. It is near the surface.
MergedVertex mergedVertex(const EditedMesh& mesh, std::uint32_t a, std::uint32_t b);

/// Returns the edit that merges the ends of an edge into the point of `mergedVertex`, or std::nullopt if the mesh would
/// be no manifold afterwards, or if an end is at the mesh's boundary.
std::optional<Edit> collapseOf(const EditedMesh& mesh, std::uint32_t a, std::uint32_t b);

/// Moves the position of an edit's vertex onto the surface.
void placeVertex(const ImplicitSurface& surface, const EditLimits& limits, Edit& edit);

}  // namespace hpsdf::contouring
