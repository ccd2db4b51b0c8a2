#include "combine/similarity.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "hpsdf/error.h"
#include "util/refuse.h"

namespace hpsdf::combine {
namespace {

/// Returns cosine and sine of an angle in degrees, exactly for quarter turns.
std::array<double, 2> cosineAndSine(double degrees) {
  const double turned = std::remainder(degrees, 360.0);  // exact, from -180 to 180
  if (turned == 0) return {1, 0};
  if (std::abs(turned) == 180) return {-1, 0};
  if (std::abs(turned) == 90) return {0, turned / 90};
  const double angle = turned * (std::numbers::pi / 180);
  return {std::cos(angle), std::sin(angle)};
}

double greatestCoordinate(const Box& box) { return box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff(); }

}  // namespace

Similarity after(const Similarity& outer, const Similarity& inner) {
  return {outer.rotation * inner.rotation, outer.scale * inner.scale, outer(inner.translation)};
}

Similarity moveBy(const std::vector<double>& numbers) {
  return {.translation = Vector3(numbers[0], numbers[1], numbers[2])};
}

Similarity rotateBy(const std::vector<double>& numbers) {
  const Vector3 axis = Vector3(numbers[0], numbers[1], numbers[2]).stableNormalized();
  const auto [cosine, sine] = cosineAndSine(numbers[3]);
  Eigen::Matrix3d across;  // across · x = axis × x
  across << 0, -axis.z(), axis.y(), axis.z(), 0, -axis.x(), -axis.y(), axis.x(), 0;
  return {.rotation = cosine * Eigen::Matrix3d::Identity() + sine * across + (1 - cosine) * axis * axis.transpose()};
}

Similarity scaleBy(const std::vector<double>& numbers) { return {.scale = numbers[0]}; }

TriangleMesh transformed(const TriangleMesh& mesh, const Similarity& by) {
  TriangleMesh result = mesh;
  for (Vector3& vertex : result.vertices) vertex = by(vertex);
  return result;
}

Box transformed(const Box& box, const Similarity& by) {
  Box result;
  if (box.isEmpty()) return result;
  for (int corner = 0; corner < 8; ++corner) result.extend(by(box.corner(static_cast<Box::CornerType>(corner))));
  return result;
}

void requireUsable(const Similarity& placement, const Box& box) {
  const double reach = std::max(placement.scale, placement.translation.cwiseAbs().maxCoeff());
  if (!(placement.scale * kLargestCoordinate >= 1) || !(reach <= kLargestCoordinate))
    detail::refuse("moves and scales have a total beyond 1e100 or below 1e-100");
  if (box.isEmpty() || !box.sizes().allFinite()) return;
  const double size = placement.scale * box.sizes().norm();
  const Box placed = transformed(box, placement);
  const double greatest = greatestCoordinate(placed);
  if (!(size > 0) || !(greatest <= kLargestCoordinate) || !placed.sizes().allFinite())
    detail::refuse("moves and scales give it coordinates beyond 1e100, or shrink it to a point");
  const double shareBefore = box.sizes().norm() / greatestCoordinate(box);
  if (size < std::min(kLeastShareOfCoordinates, 0.5 * shareBefore) * greatest)
    detail::refuse("moves and scales put it at coordinates of ", greatest,
                   ", where rounding spoils a solid of the size ", size, "; keep the solids nearer to the origin");
}

}  // namespace hpsdf::combine
