#include "hpsdf/safe_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "field/cells/cell_bounds.h"
#include "field/query/blend.h"
#include "field/query/evaluate.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace {

void requireBounds(const Field& field) {
  if (field.data().bounds.empty()) throw Error("the field has no bounds for safe distances: build it with bounds");
}

}  // namespace

std::optional<CellBound> boundAt(const Field& field, const Vector3& x) {
  if (field.data().bounds.empty()) return {};
  const GridFrame& frame = field.lookupGrid().frame;
  const query::GridPoint point = query::gridPoint(frame, query::closestInDomain(frame, x));
  return field.data().bounds[query::findLeafNode(field.data(), point).node];
}

double safeDistance(const Field& field, const Vector3& x) {
  requireBounds(field);
  const FieldData& data = field.data();
  const GridFrame& frame = field.lookupGrid().frame;
  const Vector3 closest = query::closestInDomain(frame, x);
  const query::GridPoint point = query::gridPoint(frame, closest);
  // Find the leaf from its base cell down, not by the lookup grid. The error bounds are stored by node index,
  // which the lookup grid does not give.
  const auto [node, depth, cellIndex] = query::findLeafNode(data, point);
  const query::LeafPoint leaf = query::leafPoint(data.nodes[node], depth, node, cellIndex, point.coordinates);
  const double value = query::evaluateInLeaf<double>(data, field.lookupGrid(), point.coordinates, leaf);
  return std::max(0.0, std::abs(value) - double(data.bounds[node].error) - query::length(x - closest));
}

SafeTrace safeTrace(const Field& field, const Vector3& origin, const Vector3& direction, double slack) {
  requireBounds(field);
  const double norm = direction.norm();
  if (!origin.allFinite() || !(norm > 0) || !std::isfinite(norm))
    throw Error("a ray needs a finite origin and a direction that is not zero");
  if (!(slack > 0)) throw Error("the slack of a ray must be above 0");

  // Find the part of the ray that lies in the domain.
  const Vector3 unit = direction / norm;
  const Box& domain = field.domain();
  double first = 0, last = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (unit[axis] == 0) {
      if (origin[axis] < domain.min()[axis] || origin[axis] > domain.max()[axis]) return {};
      continue;
    }
    const auto [enter, leave] = std::minmax(
        {(domain.min()[axis] - origin[axis]) / unit[axis], (domain.max()[axis] - origin[axis]) / unit[axis]});
    first = std::max(first, enter);
    last = std::min(last, leave);
  }

  // March along the ray by safe distances. Each step is reduced by the rounding error of the points, which is
  // large if the ray's origin is far from the domain.
  SafeTrace trace{.length = first};
  const double rounding = 8 * std::numeric_limits<double>::epsilon() * (query::length(origin) + std::abs(last));
  while (trace.length < last) {
    const double step = safeDistance(field, origin + trace.length * unit) - rounding;
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
  data.metadata.exactEvaluations += withThreads(threads, [&] { return detail::findBounds(data, distance, progress); });
  return Field(std::move(data));
}

}  // namespace hpsdf
