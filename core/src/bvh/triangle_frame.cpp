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

}  // namespace

TriangleFrame makeFrame(const std::array<Vector3, 3>& corners, std::uint32_t triangle) {
  const int first = longestSide(corners);
  const Vector3& a = corners[first];
  const Vector3& b = corners[(first + 1) % 3];
  const Vector3& c = corners[(first + 2) % 3];
  const Vector3 base = b - a;
  const Vector3 apex = c - a;

  TriangleFrame frame;
  frame.triangle = triangle;
  frame.firstCorner = static_cast<std::uint32_t>(first);
  frame.origin = a;
  frame.length = base.norm();
  frame.along = frame.length > 0 ? Vector3(base / frame.length) : Vector3::UnitX();
  // For a sliver, rounding may tilt the computed normal noticeably towards the base. `withoutBase` removes the
  // component of the normal along the base, before and after scaling to unit length. The remaining error is a
  // rotation about the base, which moves no point of the triangle by more than a rounding error. For triangles
  // parallel to a coordinate plane the normal is exact.
  const auto withoutBase = [&](const Vector3& v) -> Vector3 { return v - frame.along * frame.along.dot(v); };
  const Vector3 normal = withoutBase(frame.along.cross(apex));
  const double height = normal.norm();
  const double size = std::max({a.cwiseAbs().maxCoeff(), b.cwiseAbs().maxCoeff(), c.cwiseAbs().maxCoeff()});
  const bool flat = height <= kFlat * size;
  frame.normal = flat ? frame.along.unitOrthogonal() : withoutBase(normal / height).normalized();
  frame.across = frame.normal.cross(frame.along);
  frame.apexAlong = std::clamp(frame.along.dot(apex), 0.0, frame.length);
  frame.apexAcross = flat ? 0 : frame.across.dot(apex);
  frame.inverseSquaredLeft = inverseSquare(frame.apexAlong * frame.apexAlong + frame.apexAcross * frame.apexAcross);
  const double rest = frame.apexAlong - frame.length;
  frame.inverseSquaredRight = inverseSquare(rest * rest + frame.apexAcross * frame.apexAcross);
  return frame;
}

}  // namespace hpsdf::bvh
