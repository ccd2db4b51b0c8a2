#pragma once
// The sign of the distance in exact leaves whose triangles intersect each other.

#include <cstdint>

#include "hpsdf/detail/field_data.h"

namespace hpsdf {

/// Returns the winding number at a point of an exact leaf with `ExactSign::winding`, plus 1 in a mesh that is oriented
/// inward. The point is inside if this number is above 0. `leaf` is the packed node.
///
/// The number is that of the leaf's reference point, changed by 1 for each listed triangle that the segment between the
/// two points crosses. A segment through an edge or a vertex crosses the surface there as often as its neighbours do.
std::int64_t windingAt(const ExactTriangles& exact, std::uint64_t leaf, const Vector3& x);

/// Returns 1 if the signed distance grows along the unit normal of a face at a point of an exact leaf with
/// `ExactSign::winding` that is nearest to this face, and −1 if it falls. `height` is the point's signed distance from
/// the face's plane. On the surface, where the point's own sign depends on rounding, the sides of the face decide.
int slopeByWinding(const ExactTriangles& exact, std::uint64_t leaf, const Vector3& x, const Vector3& normal,
                   double height);

}  // namespace hpsdf
