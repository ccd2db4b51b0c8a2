#pragma once

#include <vector>

#include "contour/cells/implicit_surface.h"
#include "contour/edits/mesh_editor.h"
#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::contouring {

/// Returns a mesh for editing, with points of the surface that it approximates: its vertices, and others near each
/// triangle.
EditedMesh editedMesh(const ImplicitSurface& surface, const EditLimits& limits, TriangleMesh mesh);

/// The greatest errors that were found of a mesh.
struct MeshErrors {
  double value = 0;  ///< magnitude of the function in a triangle
  double gap = 0;    ///< distance of a point of the surface from the mesh
};

/// Measures a mesh: searches the greatest value more closely where it is not far below the tolerance.
MeshErrors measure(const ImplicitSurface& surface, double tolerance, const Progress& progress, const EditedMesh& mesh);

/// Turns over triangles that are folded: those whose normals point away from that of the surface. Their longest sides
/// are replaced by the other diagonals of the quadrilaterals, or their shortest sides become points.
void unfold(const ImplicitSurface& surface, const EditLimits& limits, const Progress& progress, EditedMesh& mesh);

/// Merges vertices along edges, those of the flattest places first, as long as the mesh is within the tolerance.
/// Vertices at the boundary of an open mesh stay.
void simplify(const ImplicitSurface& surface, const EditLimits& limits, const Progress& progress, EditedMesh& mesh);

}  // namespace hpsdf::contouring
