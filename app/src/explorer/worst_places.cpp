#include "explorer/worst_places.h"

#include <algorithm>
#include <cmath>

namespace hpsdf::app {
namespace {

constexpr double kAtSurface = 0.1;  // greatest |f| at the surface, in edges of the smaller cell

}  // namespace

double cellSizeAt(const Field& field, int depth) {
  return std::ldexp(field.domain().sizes()[0] / field.grid()[0], -depth);
}

bool isAtSurface(const Field& field, const Interface& face) {
  const double edge = cellSizeAt(field, std::max(face.depths[0], face.depths[1]));
  return std::abs(field.value(face.worst)) <= std::max(kAtSurface * edge, face.value.max);
}

bool isTorn(const Field& field, const Interface& face) { return std::abs(field.value(face.worst)) < face.value.max; }

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
