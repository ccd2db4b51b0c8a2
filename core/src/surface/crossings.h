#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "bvh/hierarchy.h"
#include "hpsdf/error.h"
#include "hpsdf/mesh_report.h"

namespace hpsdf::distance {

/// Whether two triangles have a point in common, without rounding. Coordinates of order 1.
bool meet(const std::array<Vector3, 3>& one, const std::array<Vector3, 3>& other);

/// Whether a side of the second, of those that count, passes through or touches the first, both in one plane but for
/// rounding, seen along the axis from which the second shows the most area.
bool sidesCut(const std::array<Vector3, 3>& one, const std::array<Vector3, 3>& other,
              const std::array<bool, 3>& counts);

/// Whether they lie in one plane, but for rounding. Coordinates of order 1.
bool lieInOnePlane(const std::array<Vector3, 3>& one, const std::array<Vector3, 3>& other);

/// A power of two, so that it rounds nothing, times which coordinates are of order 1.
double scaleToOne(std::span<const Vector3> vertices);

/// `hpsdf::findCrossings` of a hierarchy's triangles, by their indices in the mesh. With a margin, of coordinates of
/// order 1, also those that come as near each other, to rounding.
Crossings findCrossings(const Hierarchy& hierarchy, std::size_t limit, double margin, const Progress& progress);

}  // namespace hpsdf::distance
