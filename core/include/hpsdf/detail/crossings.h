#pragma once

#include <cstddef>

#include "hpsdf/error.h"
#include "hpsdf/mesh_report.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// Returns the self-intersections of a mesh, found by exact predicates (Shewchuk 1997). Corners are shared where their
/// vertex indices are equal: weld the mesh first. Degenerate triangles are ignored, because their neighbours contain
/// their edges.
///
/// Returns at most `limit` crossings, the same ones for any number of threads. Throws `Error` for what `ExactDistance`
/// refuses too, and `Cancelled`.
Crossings findCrossings(const TriangleMesh& mesh, std::size_t limit = kMaxCrossings, const Progress& progress = {});

}  // namespace hpsdf
