#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "contour/cells/contour_octree.h"
#include "contour/cells/crossed_edges.h"
#include "contour/cells/implicit_surface.h"
#include "contour/sheets.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf::contouring {

/// The triangles of the polygons around crossed edges. A polygon is divided by a diagonal, or, if it is marked, into a
/// fan around the point where the surface crosses its edge, with further corners in the faces between its leaves. The
/// triangles of a fan lie within one leaf each and therefore do not cross those of other leaves (Ju and Udeshi 2006).
struct DualMesh {
  std::vector<Vector3> vertices;  ///< one for each sheet, then others
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> edgeOfTriangle;  ///< the crossed edge around which a triangle's polygon lies
};

/// Makes the mesh, and chooses the diagonals of the polygons that have changed. `fans` marks the edges whose polygons
/// become fans; it is empty if there are none. The function is at most `accuracy` at further corners, unless several
/// sheets run through their face.
DualMesh makeDualMesh(const ImplicitSurface& surface, const ContourOctree& octree, std::span<CrossedEdge> edges,
                      const Sheets& sheets, std::vector<Vector3> vertices, const std::vector<bool>& fans,
                      double accuracy);

}  // namespace hpsdf::contouring
