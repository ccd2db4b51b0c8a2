#include "contour/cells/implicit_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hpsdf::contouring {
namespace {

/// Returns the greatest of the six signed distances from x to the planes of a box's faces, with its gradient.
ValueAndGradient toWall(const Box& box, const Vector3& x) {
  const Vector3 beyond = (x - box.center()).cwiseAbs() - box.sizes() / 2;
  int axis = 0;
  const double value = beyond.maxCoeff(&axis);
  return {value, Vector3::Unit(axis) * (x[axis] < box.center()[axis] ? -1 : 1)};
}

/// Returns the range of `toWall` over a box of points.
Interval wallRange(const Box& box, const Box& points) {
  Interval range{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (int axis = 0; axis < 3; ++axis) {
    const double center = box.center()[axis], half = box.sizes()[axis] / 2;
    const double low = points.min()[axis] - center, high = points.max()[axis] - center;
    const double nearest = low <= 0 && high >= 0 ? 0 : std::min(std::abs(low), std::abs(high));
    range.min = std::max(range.min, nearest - half);
    range.max = std::max(range.max, std::max(std::abs(low), std::abs(high)) - half);
  }
  return range;
}

}  // namespace

ImplicitSurface::ImplicitSurface(const Field& field, double offset, double thin, std::optional<double> wall,
                                 int threads)
    : field_(field), ranges_(field, threads, Interval{offset - thin, offset + thin}), offset_(offset), thin_(thin) {
  if (!wall) return;
  const Vector3 inset = Vector3::Constant(*wall).cwiseMin(field.domain().sizes() / 4);
  wall_ = Box(Vector3(field.domain().min() + inset), Vector3(field.domain().max() - inset));
}

void ImplicitSurface::values(std::span<const Vector3> points, std::span<double> out) const {
  valuesWithoutWall(points, out);
  for (std::size_t i = 0; i < points.size() && wall_; ++i) out[i] = std::max(out[i], toWall(*wall_, points[i]).value);
}

void ImplicitSurface::valuesWithoutWall(std::span<const Vector3> points, std::span<double> out) const {
  field_.values(points, out);
  for (double& value : out) value -= offset_;
}

void ImplicitSurface::valuesAndGradients(std::span<const Vector3> points, std::span<ValueAndGradient> out) const {
  field_.valuesAndGradients(points, out);
  for (std::size_t i = 0; i < points.size(); ++i) {
    out[i].value -= offset_;
    if (!wall_) continue;
    const ValueAndGradient wall = toWall(*wall_, points[i]);
    if (wall.value > out[i].value) out[i] = wall;
  }
}

bool ImplicitSurface::isAtWall(const Vector3& x) const {
  return wall_ && toWall(*wall_, x).value > field_.value(x) - offset_;
}

bool ImplicitSurface::mayChangeSign(const Box& box, bool isInside) const {
  // The margin makes the faces belong to the box, because values there may be those of leaves beside it.
  const Vector3 margin = 1e-9 * box.sizes();
  const Box wider(Vector3(box.min() - margin), Vector3(box.max() + margin));
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  const Interval harmless = isInside ? Interval{-kEndless, thin_} : Interval{-thin_, kEndless};
  const Interval known{harmless.min + offset_, harmless.max + offset_};
  const Interval value = ranges_.range(wider, known).value;
  Interval range{value.min - offset_, value.max - offset_};
  if (wall_) {
    const Interval wall = wallRange(*wall_, wider);
    range = {std::max(range.min, wall.min), std::max(range.max, wall.max)};
  }
  return range.min < harmless.min || range.max > harmless.max;
}

}  // namespace hpsdf::contouring
