#include "hpsdf/safe_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "field/build/cell_bounds.h"
#include "field/query/blend.h"
#include "field/query/evaluate.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace {

void requireBounds(const Field& field) {
  if (field.data().bounds.empty())
    throw Error("the field keeps no bounds, without which no distance is safe: build it with bounds");
}

}  // namespace

std::optional<CellBound> boundAt(const Field& field, const Vector3& x) {
  if (field.data().bounds.empty()) return {};
  const GridFrame& frame = field.lookupGrid().frame;
  return field.data().bounds[locate(field.data(), gridPoint(frame, closestWithin(frame, x))).node];
}

double safeDistance(const Field& field, const Vector3& x) {
  requireBounds(field);
  const FieldData& data = field.data();
  const GridFrame& frame = field.lookupGrid().frame;
  const Vector3 closest = closestWithin(frame, x);
  const GridPoint point = gridPoint(frame, closest);
  // by the octree rather than the lookup grid, which knows no leaf's node
  const auto [node, depth] = locate(data, point);
  const FoundLeaf leaf =
      leafWithin(data.nodes[node], depth, node, {point.cell(0, depth), point.cell(1, depth), point.cell(2, depth)},
                 point.coordinates);
  const double value = answerWithin<double>(data, field.lookupGrid(), point.coordinates, leaf);
  return std::max(0.0, std::abs(value) - double(data.bounds[node].error) - length(x - closest));
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
  // the point at a length is off by a few units in the last place, which far from the domain may be much
  const double rounding = 8 * std::numeric_limits<double>::epsilon() * (length(origin) + std::abs(last));
  while (trace.length < last) {
    const double step = safeDistance(field, origin + trace.length * along) - rounding;
    ++trace.steps;
    if (!(step >= std::max(slack, rounding))) {
      trace.mayTouch = true;
      return trace;
    }
    trace.length += step;
  }
  trace.length = std::max(first, last);
  return trace;
}

Field withBounds(const Field& field, const DistanceFunction& distance, int threads, const Progress& progress) {
  FieldData data = field.data();
  data.metadata.exactEvaluations += withThreads(threads, [&] { return findBounds(data, distance, progress); });
  return Field(std::move(data));
}

}  // namespace hpsdf
