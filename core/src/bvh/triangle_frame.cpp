#include "bvh/triangle_frame.h"

#include <cmath>

namespace hpsdf::bvh {
namespace {

double inverseSquare(double squaredLength) {
  return squaredLength >= std::numeric_limits<double>::min() ? 1 / squaredLength : 0;
}

int longestSide(const std::array<Vector3, 3>& corners) {
  int longest = 0;
  double longestSquared = -1;
  for (int k = 0; k < 3; ++k) {
    const double squared = (corners[(k + 1) % 3] - corners[k]).squaredNorm();
    if (squared > longestSquared) longest = k, longestSquared = squared;
  }
  return longest;
}

/// The longest side of a triangle and the triangle's plane.
struct BaseAndPlane {
  int first;  ///< number of the corner A among the corners of the triangle
  double length;
  Vector3 along, apex;  ///< `apex` leads from A to C
  Vector3 normal;
  bool isFlat;  ///< the triangle has no area, and the normal is any that is perpendicular to the side
};

BaseAndPlane baseOf(const std::array<Vector3, 3>& corners) {
  BaseAndPlane of;
  of.first = longestSide(corners);
  const Vector3& a = corners[of.first];
  const Vector3& b = corners[(of.first + 1) % 3];
  const Vector3& c = corners[(of.first + 2) % 3];
  const Vector3 base = b - a;
  of.apex = c - a;
  of.length = base.norm();
  of.along = of.length > 0 ? Vector3(base / of.length) : Vector3::UnitX();
  // For a sliver, rounding may tilt the computed normal noticeably towards the base. `withoutBase` removes the
  // component of the normal along the base, before and after scaling to unit length. The remaining error is a
  // rotation about the base, which moves no point of the triangle by more than a rounding error. For triangles
  // parallel to a coordinate plane the normal is exact.
  const auto withoutBase = [&](const Vector3& v) -> Vector3 { return v - of.along * of.along.dot(v); };
  const Vector3 normal = withoutBase(of.along.cross(of.apex));
  const double height = normal.norm();
  const double size = std::max({a.cwiseAbs().maxCoeff(), b.cwiseAbs().maxCoeff(), c.cwiseAbs().maxCoeff()});
  of.isFlat = height <= kFlat * size;
  of.normal = of.isFlat ? of.along.unitOrthogonal() : withoutBase(normal / height).normalized();
  return of;
}

}  // namespace

TriangleFrame makeFrame(const std::array<Vector3, 3>& corners, std::uint32_t triangle) {
  const BaseAndPlane of = baseOf(corners);
  TriangleFrame frame;
  frame.triangle = triangle;
  frame.firstCorner = static_cast<std::uint32_t>(of.first);
  frame.origin = corners[of.first];
  frame.length = of.length;
  frame.along = of.along;
  frame.normal = of.normal;
  frame.across = frame.normal.cross(frame.along);
  frame.apexAlong = std::clamp(frame.along.dot(of.apex), 0.0, frame.length);
  frame.apexAcross = of.isFlat ? 0 : frame.across.dot(of.apex);
  frame.inverseSquaredLeft = inverseSquare(frame.apexAlong * frame.apexAlong + frame.apexAcross * frame.apexAcross);
  const double rest = frame.apexAlong - frame.length;
  frame.inverseSquaredRight = inverseSquare(rest * rest + frame.apexAcross * frame.apexAcross);
  return frame;
}

Vector3 unitNormalOf(const std::array<Vector3, 3>& corners) {
  const BaseAndPlane of = baseOf(corners);
  return of.isFlat ? Vector3(Vector3::Zero()) : of.normal;
}

}  // namespace hpsdf::bvh
