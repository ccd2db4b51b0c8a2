#include "hpsdf/safe_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "field/evaluate.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace {

void requireBounds(const Field& field) {
  if (field.data().bounds.empty())
    throw Error("the field keeps no bounds, without which no distance is safe: build it with bounds");
}

}  // namespace

std::optional<CellBound> boundAt(const Field& field, const Vector3& x) {
  const FieldData& data = field.data();
  if (data.bounds.empty()) return {};
  const GridFrame frame = gridFrame(data);
  return data.bounds[locate(data, gridPoint(frame, closestWithin(frame, x))).node];
}

double safeDistance(const Field& field, const Vector3& x) {
  requireBounds(field);
  const Vector3 closest = closestWithin(gridFrame(field.data()), x);
  const double certain = std::abs(field.value(closest)) - double(boundAt(field, closest)->error);
  return std::max(0.0, certain - (x - closest).norm());
}

SafeTrace safeTrace(const Field& field, const Vector3& origin, const Vector3& direction, double slack) {
  requireBounds(field);
  const double norm = direction.norm();
  if (!origin.allFinite() || !(norm > 0) || !std::isfinite(norm))
    throw Error("a ray needs a finite origin and a direction");
  if (!(slack > 0)) throw Error("the slack of a ray must be above 0");
  const Vector3 along = direction / norm;
  const Box& domain = field.domain();
  double first = 0, last = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (along[axis] == 0) {
      if (origin[axis] < domain.min()[axis] || origin[axis] > domain.max()[axis]) return {};
      continue;
    }
    const auto [enter, leave] = std::minmax(
        {(domain.min()[axis] - origin[axis]) / along[axis], (domain.max()[axis] - origin[axis]) / along[axis]});
    first = std::max(first, enter);
    last = std::min(last, leave);
  }
  SafeTrace trace{.length = first};
  while (trace.length < last) {
    const double step = safeDistance(field, origin + trace.length * along);
    ++trace.steps;
    if (step < slack) {
      trace.mayTouch = true;
      return trace;
    }
    trace.length += step;
  }
  trace.length = std::max(first, last);
  return trace;
}

}  // namespace hpsdf
