#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "hpsdf/types.h"

namespace hpsdf::distance {

/// A triangle in its own right-handed orthonormal frame, longest side first: corner A at the origin, B at (length, 0),
/// the apex C at (apexAlong, apexAcross) with 0 ≤ apexAlong ≤ length and apexAcross ≥ 0.
///
/// The frame is orthonormal to rounding and the plane coordinates are measured in it, so that whatever the shape, thin
/// or even collapsed, what it stands for differs from the given triangle by a few roundings of its longest side.
/// Distances therefore need no special case for slivers. A triangle without area has apexAcross = 0: no point projects
/// strictly into it, and its sides answer.
struct TriangleFrame {
  Vector3 origin;             ///< A
  Vector3 along;              ///< unit vector from A to B
  Vector3 across;             ///< unit vector in the plane, towards C
  Vector3 normal;             ///< unit normal, the side that sees A, B, C counter-clockwise
  double length;              ///< |AB|
  double apexAlong;           ///< C in the plane
  double apexAcross;          ///< 0 where the triangle has no area
  double inverseSquaredLeft;  ///< 1/|AC|², 0 where A = C
  double inverseSquaredRight;
  std::uint32_t triangle;     ///< index in the mesh
  std::uint32_t firstCorner;  ///< A is this corner (0, 1, 2) of the mesh's triangle, B and C follow cyclically
};

inline bool hasArea(const TriangleFrame& frame) { return frame.apexAcross > 0; }

/// Below this height, in roundings of the coordinates, a triangle's normal is noise.
constexpr double kFlat = 4 * std::numeric_limits<double>::epsilon();

TriangleFrame makeFrame(const std::array<Vector3, 3>& corners, std::uint32_t triangle);

/// A point in a triangle's frame, and its squared distances within the plane to the three sides.
struct FramePoint {
  double height;  ///< above the plane, signed
  std::array<double, 3> side;
  bool inside;  ///< projects strictly into the triangle
};

/// search.cpp has the same in vectors; tests hold that against this.
inline FramePoint locate(const TriangleFrame& f, const Vector3& x) {
  const double wx = x[0] - f.origin[0], wy = x[1] - f.origin[1], wz = x[2] - f.origin[2];
  const double p = wx * f.along[0] + wy * f.along[1] + wz * f.along[2];
  const double q = wx * f.across[0] + wy * f.across[1] + wz * f.across[2];
  const double height = wx * f.normal[0] + wy * f.normal[1] + wz * f.normal[2];

  const auto unit = [](double t) { return std::min(std::max(t, 0.0), 1.0); };
  const double base = p - std::min(std::max(p, 0.0), f.length);
  const double left = unit((p * f.apexAlong + q * f.apexAcross) * f.inverseSquaredLeft);
  const double leftP = p - left * f.apexAlong, leftQ = q - left * f.apexAcross;
  const double fromB = p - f.length, rightAlong = f.apexAlong - f.length;
  const double right = unit((fromB * rightAlong + q * f.apexAcross) * f.inverseSquaredRight);
  const double rightP = fromB - right * rightAlong, rightQ = q - right * f.apexAcross;
  // bitwise "and": three predictable comparisons are cheaper than three branches
  const bool inside = (q > 0) & (p * f.apexAcross > q * f.apexAlong) & (q * rightAlong > fromB * f.apexAcross);
  return {height, {base * base + q * q, rightP * rightP + rightQ * rightQ, leftP * leftP + leftQ * leftQ}, inside};
}

inline double squaredDistance(const TriangleFrame& f, const Vector3& x) {
  const FramePoint point = locate(f, x);
  const double nearestSide = std::min(std::min(point.side[0], point.side[1]), point.side[2]);
  return point.height * point.height + (point.inside ? 0.0 : nearestSide);
}

}  // namespace hpsdf::distance
