#include "explorer/worst_places.h"

#include <algorithm>
#include <cmath>

namespace hpsdf::app {
namespace {

constexpr double kAtSurface = 0.1;  // greatest |f| at the surface, in edges of the smaller cell
constexpr double kAcross = 1e-9;    // distance from a face at which one of its sides is evaluated, in domain sizes
constexpr double kLeastGap = 1e-7;  // a jump that is smaller tears nothing: it may be rounding; in domain sizes

}  // namespace

double cellSizeAt(const Field& field, int depth) {
  return std::ldexp(field.domain().sizes()[0] / field.grid()[0], -depth);
}

bool isAtSurface(const Field& field, const Interface& face) {
  const double edge = cellSizeAt(field, std::max(face.depths[0], face.depths[1]));
  return std::abs(field.value(face.worst)) <= kAtSurface * edge || isTorn(field, face);
}

bool isTorn(const Field& field, const Interface& face) {
  const double size = field.domain().sizes()[face.axis];
  if (face.value.max < kLeastGap * size) return false;
  const Vector3 across = kAcross * size * Vector3::Unit(face.axis);
  return field.value(face.worst - across) * field.value(face.worst + across) < 0;
}

std::vector<std::size_t> worstPlaces(const Field& field, const Jumps& jumps, JumpKind kind, bool atSurface,
                                     std::size_t count) {
  if (!atSurface) return worstInterfaces(jumps, kind, count);
  std::vector<std::size_t> places;
  for (const std::size_t index : worstInterfaces(jumps, kind, jumps.interfaces.size())) {
    if (places.size() == count) break;
    if (isAtSurface(field, jumps.interfaces[index])) places.push_back(index);
  }
  return places;
}

}  // namespace hpsdf::app
