// Measures a finished field at random points, at a small part of the cost of its construction.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "hpsdf/detail/threads.h"
#include "hpsdf/detail/triangle_search.h"
#include "hpsdf/verify.h"
#include "util/chunks.h"

namespace hpsdf {
namespace {

constexpr std::size_t kPointsPerPart = 2048;

/// Sums over points, and the point with the greatest error.
struct ErrorSums {
  detail::Sums errors;
  std::uint64_t wrongSigns = 0;
  double greatest = -1;
  Vector3 worst = Vector3::Zero();

  void add(const ErrorSums& other) {
    errors.add(other.errors);
    wrongSigns += other.wrongSigns;
    if (other.greatest <= greatest) return;
    greatest = other.greatest;
    worst = other.worst;
  }
};

ErrorSums errorsAt(const Field& field, const ExactSamples& samples, double signThreshold) {
  const auto addChunk = [&](ErrorSums& sums, std::size_t first, std::size_t count) {
    std::vector<double> values(count);
    field.values(std::span(samples.points).subspan(first, count), values);
    for (std::size_t n = 0; n < count; ++n) {
      const double exact = samples.distances[first + n], error = std::abs(values[n] - exact);
      sums.errors.add(error);
      sums.wrongSigns += values[n] * exact < 0 && std::abs(exact) > signThreshold;
      if (error <= sums.greatest) continue;
      sums.greatest = error;
      sums.worst = samples.points[first + n];
    }
  };
  return detail::sumOfChunks<ErrorSums>(samples.points.size(), kPointsPerPart, {}, "", addChunk);
}

/// Returns true if x lies within half of the field's jump across a face of its cell from this face. Where the field
/// jumps by J, its surface ends in a step of about this height, and J times the length of all such faces is the area of
/// the cracks.
bool isTornAt(const Field& field, const Vector3& x) {
  constexpr double kNear = 0.05;  // no field of use jumps by more than twice this share of a cell's edge
  constexpr double kAcross = 1e-9;
  const Box box = field.cellAt(x).box;
  const Vector3 size = box.sizes();
  for (int axis = 0; axis < 3; ++axis)
    for (const double face : {box.min()[axis], box.max()[axis]}) {
      const double distance = std::abs(x[axis] - face);
      if (distance > kNear * size[axis]) continue;
      if (face == field.domain().min()[axis] || face == field.domain().max()[axis]) continue;
      Vector3 below = x, above = x;
      below[axis] = face - kAcross * size[axis];
      above[axis] = face + kAcross * size[axis];
      if (distance < std::abs(field.value(above) - field.value(below)) / 2) return true;
    }
  return false;
}

/// Returns the triangles to which distances are measured, or std::nullopt if there are none.
std::optional<TriangleMesh> surfaceOf(const DistanceFunction& distance) {
  const TriangleSearch* search = distance.triangleSearch();
  if (search == nullptr) return std::nullopt;
  const auto vertices = search->vertices();
  const auto triangles = search->triangles();
  TriangleMesh surface;
  surface.vertices.assign(vertices.begin(), vertices.end());
  surface.triangles.assign(triangles.begin(), triangles.end());
  return surface;
}

/// Returns points within `near` of the surface. There are none if no part of the surface lies in the domain.
ExactSamples samplesNear(const DistanceFunction& distance, const std::optional<TriangleMesh>& surface,
                         const Box& domain, double near, const SampleOptions& options, const Progress& progress) {
  try {
    if (surface) return sampleNear(distance, *surface, domain, near, options, progress);
    return sampleUniform(distance, domain, near, options, progress);
  } catch (const Error&) {
    return {};
  }
}

}  // namespace

Measurement measure(const Field& field, const DistanceFunction& distance, const MeasureOptions& options,
                    const Progress& progress) {
  constexpr std::uint64_t kFewest = 20'000, kMost = 100'000;
  // Signs near a surface that is exact but for rounding to float do not count as wrong.
  constexpr double kLeastThreshold = 1e-6;
  const FieldMetadata& metadata = field.metadata();
  const double length = metadata.referenceLength;
  Measurement result;
  result.nearDistance = options.near > 0 ? options.near : 0.01 * length;
  const std::size_t points =
      options.points > 0 ? options.points : std::clamp(metadata.exactEvaluations / 10, kFewest, kMost);
  const SampleOptions half{
      .count = std::max<std::size_t>(1, points / 2), .seed = options.seed, .threads = options.threads};
  SampleOptions other = half;
  other.seed = ~options.seed;
  const std::optional<TriangleMesh> surface = surfaceOf(distance);
  return withThreads(options.threads, [&] {
    const ExactSamples uniform =
        sampleUniform(distance, field.domain(), metadata.settings.band, half, detail::partOf(progress, 0, 0.45));
    const ExactSamples near =
        samplesNear(distance, surface, field.domain(), result.nearDistance, other, detail::partOf(progress, 0.45, 0.9));
    result.points = uniform.points.size() + near.points.size();
    const ErrorSums nearErrors = errorsAt(field, near, 0);
    result.near = {nearErrors.errors.rms(), nearErrors.errors.max};
    result.signThreshold = std::max(10 * result.near.rms, kLeastThreshold * length);
    const ErrorSums domainErrors = errorsAt(field, uniform, result.signThreshold);
    result.domain = {domainErrors.errors.rms(), domainErrors.errors.max};
    result.wrongSigns = domainErrors.wrongSigns + errorsAt(field, near, result.signThreshold).wrongSigns;
    result.worst = nearErrors.greatest > domainErrors.greatest ? nearErrors.worst : domainErrors.worst;
    progress.update("measuring", 0.95);
    if (surface) result.tornShare = tornShare(field, *surface, half);
    return result;
  });
}

double tornShare(const Field& field, const TriangleMesh& surface, const SampleOptions& options) {
  if (field.data().blend > 0) return 0;
  return withThreads(options.threads, [&] {
    const std::vector<Vector3> points = sampleSurface(surface, field.domain(), options);
    const auto addChunk = [&](detail::Sums& sums, std::size_t first, std::size_t count) {
      for (std::size_t n = first; n < first + count; ++n) sums.add(isTornAt(field, points[n]) ? 1 : 0);
    };
    return detail::sumOfChunks<detail::Sums>(points.size(), kPointsPerPart, {}, "", addChunk).mean();
  });
}

Field withMeasurement(Field field, const Measurement& measurement) {
  FieldData data = std::move(field).data();
  data.metadata.measurement = measurement;
  return Field(std::move(data));
}

}  // namespace hpsdf
