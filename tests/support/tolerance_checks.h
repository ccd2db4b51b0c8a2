#pragma once
// Checks that fields that were built within a tolerance keep to it.

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/detail/exact_samples.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/field.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::support {

/// Returns the greatest error over the allowed error at random points near the surface and in the domain.
inline double greatestRatio(const Field& field, const DistanceFunction& distance, const TriangleMesh& surface) {
  const FieldMetadata& metadata = field.metadata();
  const AllowedError allowed = allowedError(metadata.settings, metadata.referenceLength);
  const SampleOptions options{.count = 50'000, .seed = 3};
  double greatest = 0;
  for (const ExactSamples& samples : {sampleNear(distance, surface, field.domain(), allowed.within, options),
                                      sampleUniform(distance, field.domain(), 0, options)}) {
    std::vector<double> values(samples.points.size());
    field.values(samples.points, values);
    for (std::size_t n = 0; n < values.size(); ++n)
      greatest = std::max(greatest, std::abs(values[n] - samples.distances[n]) / allowed.at(samples.distances[n]));
  }
  return greatest;
}

/// Returns the greatest error, over the tolerance, of a field of a distance with a kink, on the line through `from`
/// along an axis. The field begins with a single cell.
inline double greatestRatioOnLine(const std::function<double(const Vector3&)>& distance, double tolerance,
                                  const Vector3& from, int axis) {
  const Box domain(Vector3::Constant(-1), Vector3::Constant(1));
  const Field field = build(distance, domain, {.grid = {1, 1, 1}, .tolerance = tolerance, .within = 10});
  double worst = 0;
  for (double t = -1; t <= 1; t += 0.0005) {
    Vector3 x = from;
    x[axis] = t;
    worst = std::max(worst, std::abs(field.value(x) - distance(x)));
  }
  return worst / tolerance;
}

/// Returns the distance between two parallel faces, whose kink is the plane halfway.
inline std::function<double(const Vector3&)> halfway(int axis, double at) {
  return [axis, at](const Vector3& x) { return std::abs(x[axis] - at) - 0.25; };
}

}  // namespace hpsdf::support
