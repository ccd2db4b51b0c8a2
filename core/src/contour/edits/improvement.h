#pragma once

#include <vector>

#include "contour/cells/implicit_surface.h"
#include "contour/edits/mesh_editor.h"
#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::contouring {

/// Measures a mesh with points of the surface: searches the greatest value more closely where it is not far below the
/// tolerance.
MeshErrors measure(const ImplicitSurface& surface, const EditLimits& limits, const Progress& progress,
                   const EditedMesh& mesh);

/// Turns over triangles that are folded: those whose normals point away from that of the surface. Their longest sides
/// are replaced by the other diagonals of the quadrilaterals, or their shortest sides become points.
void unfold(MeshEditor& editor);

/// Flips edges that cut across a sharp edge of the surface, or across the direction in which it bends, where the other
/// diagonal is much nearer to the surface.
void align(MeshEditor& editor);

/// Merges vertices along edges, those of the flattest places first, as long as the mesh is within the tolerance.
/// Vertices at the boundary of an open mesh stay.
void simplify(MeshEditor& editor);

}  // namespace hpsdf::contouring
