#include "pictures/readout.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <span>

#include "construction/surface.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// Returns the distance from the point x to `face`, the axis-aligned rectangle that two cells share.
double distanceTo(const Interface& face, const Vector3& domainSizes, const Field& field, const Vector3& x) {
  const int depth = std::max(face.depths[0], face.depths[1]);
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double half =
        axis == face.axis ? 0
                          : 0.5 * std::ldexp(domainSizes[axis] / field.grid()[static_cast<std::size_t>(axis)], -depth);
    const double beyond = std::max(0.0, std::abs(x[axis] - face.center[axis]) - half);
    sum += beyond * beyond;
  }
  return std::sqrt(sum);
}

}  // namespace

Readout readoutAt(const Field& field, const Jumps& jumps, const DistanceFunction* exact, const render::Pick& pick) {
  const auto [value, gradient] = field.valueAndGradient(pick.position);
  Readout readout{pick, gradient, value, {}, {}, {}, std::numeric_limits<double>::infinity()};
  if (exact != nullptr) {
    double distance = 0;
    (*exact)(std::span(&pick.position, 1), std::span(&distance, 1));
    readout.exact = distance;
  }
  const Vector3 sizes = field.domain().sizes();
  for (const Interface& face : jumps.interfaces) {
    if (face.cells[0] != pick.cell && face.cells[1] != pick.cell) continue;
    const double distance = distanceTo(face, sizes, field, pick.position);
    if (!(distance < readout.toFace)) continue;
    readout.toFace = distance;
    readout.valueJump = face.value;
    readout.gradientJump = face.gradient;
  }
  return readout;
}

Readout readoutAt(Session& session, const render::Pick& pick) {
  const DistanceFunction* exact = session.knowsExact() ? &session.exact("") : nullptr;
  return readoutAt(session.current().field, session.jumps(), exact, pick);
}

std::vector<std::string> readoutText(const Readout& r) {
  const Vector3& x = r.pick.position;
  std::string first = fmt::format("({:.5g}, {:.5g}, {:.5g})   f {:.6g}", x.x(), x.y(), x.z(), r.value);
  if (r.exact) first += fmt::format("   exact {:.6g}   error {:.3g}", *r.exact, r.value - *r.exact);
  std::string second = fmt::format("cell {}   degree {}   depth {}   gradient ({:.4g}, {:.4g}, {:.4g}), length {:.4g}",
                                   r.pick.cell, levelName(r.pick.degree), r.pick.depth, r.gradient.x(), r.gradient.y(),
                                   r.gradient.z(), r.gradient.norm());
  if (std::isfinite(r.toFace))
    second += fmt::format("   nearest face: jump {} of f, {} of its gradient", shortNumber(r.valueJump.max),
                          shortNumber(r.gradientJump.max));
  return {first, second};
}

}  // namespace hpsdf::app
