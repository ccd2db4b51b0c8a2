#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "hpsdf/types.h"

namespace hpsdf::bvh {

/// A triangle in a right-handed orthonormal frame of its own. Its longest side is AB: corner A is the origin, B
/// is (length, 0), and the apex C is (apexAlong, apexAcross) with 0 ≤ apexAlong ≤ length and apexAcross ≥ 0.
///
/// Even for a thin or collapsed triangle, the frame reproduces the corners up to a few rounding errors of the
/// longest side, so that distances need no special case for slivers. A triangle without area has apexAcross = 0:
/// no point projects strictly into it, and its distance is the distance to its sides.
struct TriangleFrame {
  Vector3 origin;              ///< corner A
  Vector3 along;               ///< unit vector from A to B
  Vector3 across;              ///< unit vector perpendicular to AB in the triangle's plane, towards C
  Vector3 normal;              ///< unit normal; A, B, C are counter-clockwise as seen from its tip
  double length;               ///< |AB|
  double apexAlong;            ///< coordinate of C along `along`
  double apexAcross;           ///< coordinate of C along `across`, 0 where the triangle has no area
  double inverseSquaredLeft;   ///< 1/|AC|², 0 where A = C
  double inverseSquaredRight;  ///< 1/|BC|², 0 where B = C
  std::uint32_t triangle;      ///< index of the triangle in the mesh
  std::uint32_t
      firstCorner;  ///< number (0, 1, 2) of A among the corners of the mesh's triangle; B and C follow cyclically
};

inline bool hasArea(const TriangleFrame& frame) { return frame.apexAcross > 0; }

/// If a triangle's height is below kFlat times its largest coordinate, its computed normal is only rounding noise.
constexpr double kFlat = 4 * std::numeric_limits<double>::epsilon();

/// Makes the frame of a triangle. search.cpp repeats these operations in SIMD, and tests compare both versions.
TriangleFrame makeFrame(const std::array<Vector3, 3>& corners, std::uint32_t triangle);

/// Returns the normal of a triangle's frame, or zero if the triangle has no area.
Vector3 unitNormalOf(const std::array<Vector3, 3>& corners);

/// The position of a point relative to a triangle.
struct FramePoint {
  double height;               ///< signed distance to the triangle's plane
  std::array<double, 3> side;  ///< squared distances of the point's projection to the sides AB, BC and CA
  bool inside;                 ///< true if the point projects strictly into the triangle
};

/// Computes the position of point x relative to a triangle. search.cpp repeats these operations in SIMD, and
/// tests compare both versions.
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
  // A bitwise "and" of three comparisons is cheaper than three branches.
  const bool inside = (q > 0) & (p * f.apexAcross > q * f.apexAlong) & (q * rightAlong > fromB * f.apexAcross);
  return {height, {base * base + q * q, rightP * rightP + rightQ * rightQ, leftP * leftP + leftQ * leftQ}, inside};
}

inline double squaredDistance(const TriangleFrame& f, const Vector3& x) {
  const FramePoint point = locate(f, x);
  const double nearestSide = std::min(std::min(point.side[0], point.side[1]), point.side[2]);
  return point.height * point.height + (point.inside ? 0.0 : nearestSide);
}

/// Returns the squared distance from x to the nearest of `count` triangles, or that to the first one at which it is at
/// most `enough`. `frameOf(i)` returns the frame of triangle i.
template <typename FrameOf>
double leastSquaredDistance(std::size_t count, const FrameOf& frameOf, const Vector3& x, double enough) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < count && least > enough; ++i) least = std::min(least, squaredDistance(frameOf(i), x));
  return least;
}

/// Returns the parameter in [0, 1] of the point on segment ab closest to x: 0 at a, 1 at b. Returns 0 if a = b.
inline double closestParameter(const Vector3& x, const Vector3& a, const Vector3& b) {
  const Vector3 direction = b - a;
  const double squaredLength = direction.squaredNorm();
  return squaredLength > 0 ? std::clamp((x - a).dot(direction) / squaredLength, 0.0, 1.0) : 0.0;
}

}  // namespace hpsdf::bvh
