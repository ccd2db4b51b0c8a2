#pragma once

#include <cstddef>

#include "hpsdf/error.h"
#include "hpsdf/mesh_report.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// Returns the self-intersections of a mesh, found by exact predicates (Shewchuk 1997). Triangles share a
/// corner if they use the same vertex index: weld the mesh first. Degenerate triangles are ignored, because
/// neighbouring triangles contain the edges of a degenerate triangle.
///
/// Returns at most `limit` crossings, the same crossings for any number of threads. Throws `Error` for meshes
/// that `ExactDistance` also refuses, and `Cancelled` when `progress` says so.
Crossings findCrossings(const TriangleMesh& mesh, std::size_t limit = kMaxCrossings, const Progress& progress = {});

}  // namespace hpsdf
