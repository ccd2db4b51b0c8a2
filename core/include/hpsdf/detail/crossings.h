#pragma once

#include <cstddef>

#include "hpsdf/error.h"
#include "hpsdf/mesh_report.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// Where a mesh meets itself, decided without rounding (Shewchuk 1997). Corners are the same where their indices are:
/// weld them first. Triangles whose corners lie on one line are passed over, as their neighbours hold their sides.
///
/// `limit` of them at most, the same ones for any number of threads. Throws `Error` as `ExactDistance` does,
/// `Cancelled`.
Crossings findCrossings(const TriangleMesh& mesh, std::size_t limit = kMostCrossings, const Progress& progress = {});

}  // namespace hpsdf
