#pragma once

#include <cstddef>

#include "hpsdf/error.h"
#include "hpsdf/mesh_report.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// Returns the pairs of intersecting triangles of a mesh, found by exact predicates (Shewchuk 1997). The mesh must be
/// welded, because triangles share a corner only if they use the same vertex index. Degenerate triangles are ignored,
/// because their edges also lie in neighbouring triangles.
///
/// Returns at most `limit` crossings, the same crossings for any number of threads. Throws `Error` for meshes that
/// `ExactDistance` also refuses, and `Cancelled` when `progress` says so.
Crossings findCrossings(const TriangleMesh& mesh, std::size_t limit = kMaxCrossings, const Progress& progress = {});

}  // namespace hpsdf
