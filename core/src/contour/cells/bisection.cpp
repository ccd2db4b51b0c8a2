#include "contour/cells/bisection.h"

#include <array>
#include <cmath>

#include "contour/cells/cell_samples.h"

namespace hpsdf::contouring {

Vector3 bisected(const ImplicitSurface& surface, const Box& room, const Vector3& point, double accuracy) {
  constexpr int kMostSteps = 48;
  double value = 0;
  surface.values({&point, 1}, {&value, 1});
  if (std::abs(value) <= accuracy) return point;
  std::array<Vector3, 8> corners;
  for (int n = 0; n < 8; ++n) corners[n] = room.corner(static_cast<Box::CornerType>(n));
  std::array<double, 8> values;
  surface.values(corners, values);
  const Vector3* nearest = nullptr;
  for (int n = 0; n < 8; ++n)
    if (isInside(values[n]) != isInside(value) &&
        (nearest == nullptr || (corners[n] - point).squaredNorm() < (*nearest - point).squaredNorm()))
      nearest = &corners[n];
  if (nearest == nullptr) return point;
  Vector3 from = point, to = *nearest, middle = point;
  for (int step = 0; step < kMostSteps; ++step) {
    middle = (from + to) / 2;
    double at = 0;
    surface.values({&middle, 1}, {&at, 1});
    if (std::abs(at) <= accuracy) break;
    (isInside(at) == isInside(value) ? from : to) = middle;
  }
  return middle;
}

}  // namespace hpsdf::contouring
