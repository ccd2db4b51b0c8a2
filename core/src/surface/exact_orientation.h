#pragma once

#include <array>

#include "hpsdf/types.h"

namespace hpsdf::surface {

/// Returns the exact sign of ((b − a) × (c − a)) · (d − a) (Shewchuk 1997): 1 if a, b, c run counter-clockwise as seen
/// from d, 0 if all four points are coplanar, else −1. The sign is exact as long as products of three coordinates
/// neither overflow nor underflow.
int orientation(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d);

/// Returns the exact sign of (b − a) × (c − a), after projection of the points to the plane of the two coordinate
/// axes `axes`.
int orientation(const std::array<int, 2>& axes, const Vector3& a, const Vector3& b, const Vector3& c);

}  // namespace hpsdf::surface
