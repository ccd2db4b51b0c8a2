#pragma once
// On which side a point lies, without rounding: what decides whether two triangles meet.

#include <array>

#include "hpsdf/types.h"

namespace hpsdf {

/// The sign, exactly, of (b − a) × (c − a) · (d − a): above 0 where a, b, c look counter-clockwise from d, and 0 where
/// all four lie in a plane. Exact while products of three coordinates neither overflow nor underflow.
int orientation(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d);

/// The same for three points in the plane of two axes: the sign of (b − a) × (c − a).
int orientation(const std::array<int, 2>& axes, const Vector3& a, const Vector3& b, const Vector3& c);

}  // namespace hpsdf
