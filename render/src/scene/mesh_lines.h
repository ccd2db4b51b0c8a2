#pragma once

#include <vector>

#include "hpsdf/render/view.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::render {

/// Draws lines along the edges of a mesh that approximates the surface in the buffers. Returns the share of each pixel,
/// 0 to 1, that the lines cover. `lineWidth` is in pixels. Edges of triangles that face away from the eye are left out,
/// and so are edges that lie behind objects in the buffers by more than twice `tolerance`, which is the greatest
/// distance between the mesh and the surface, in world units. Short edges are fainter, so that fine parts of the mesh
/// do not become black. The clipping plane of the view cuts edges.
std::vector<float> meshLines(const TriangleMesh& mesh, double tolerance, const Box& domain, const SurfaceView& view,
                             const ViewBuffers& buffers, double lineWidth);

}  // namespace hpsdf::render
