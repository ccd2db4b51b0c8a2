#pragma once

#include <span>

#include "hpsdf/types.h"

namespace hpsdf::contouring {

/// A plane through a point of the surface, tangential to it.
struct TangentPlane {
  Vector3 point;
  Vector3 normal;  ///< unit vector
};

/// Returns the middle of the planes' points.
Vector3 middleOf(std::span<const TangentPlane> planes);

/// Returns the point with the least sum of squared distances to planes. Where the planes do not determine it, because
/// they differ by a few degrees only, it is as near as possible to `middle` (Ju et al. 2002; Lindstrom 2000 for the
/// pseudoinverse).
Vector3 meetingPointOf(std::span<const TangentPlane> planes, const Vector3& middle);

/// Returns the greatest distance of a point from planes.
double greatestDistance(const Vector3& x, std::span<const TangentPlane> planes);

}  // namespace hpsdf::contouring
