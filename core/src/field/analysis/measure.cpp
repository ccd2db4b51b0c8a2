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

/// The errors of a field at points, in the order of the points.
struct ErrorsAtPoints {
  ErrorsAtPoints(const Field& field, ExactSamples taken) : samples(std::move(taken)), values(samples.points.size()) {
    field.values(samples.points, values);
    for (std::size_t n = 0; n < values.size(); ++n) sums.add(error(n));
  }

  double error(std::size_t n) const { return std::abs(values[n] - samples.distances[n]); }
  bool hasWrongSign(std::size_t n, double threshold) const {
    return values[n] * samples.distances[n] < 0 && std::abs(samples.distances[n]) > threshold;
  }

  ExactSamples samples;
  std::vector<double> values;
  detail::Sums sums;
};

/// Adds to a measurement what depends on single points: wrong signs, the worst point and the points beyond the
/// tolerance.
void addPoints(Measurement& result, double& greatest, const ErrorsAtPoints& at, const AllowedError& allowed) {
  for (std::size_t n = 0; n < at.values.size(); ++n) {
    const double error = at.error(n);
    result.wrongSigns += at.hasWrongSign(n, result.signThreshold);
    if (error > greatest) {
      greatest = error;
      result.worst = at.samples.points[n];
    }
    if (!(allowed.tolerance > 0)) continue;
    const double ratio = error / allowed.at(at.samples.distances[n]);
    result.toleranceRatio = std::max(result.toleranceRatio, ratio);
    result.beyondTolerance += ratio > 1;
  }
}

/// The errors at random points of a part of the domain.
struct DomainPart {
  double share;  ///< of the domain's volume
  ErrorsAtPoints errors;
};

/// Draws random points of the domain, apart for polynomial and exact leaves, and measures the errors there. Exact
/// leaves have hardly any error: most points lie in the other leaves, however small their share of the volume is.
std::vector<DomainPart> measureDomain(const Field& field, const DistanceFunction& distance,
                                      const SampleOptions& options, const Progress& progress) {
  constexpr double kLeastShare = 0.005, kMostShare = 0.75;  // of polynomials, for which parts are worth while
  const double band = field.metadata().settings.band;
  const auto volume = statistics(field).degreeVolume;
  const auto exact = volume.find(kExactDegree);
  const double share = exact == volume.end() ? 1 : 1 - exact->second;
  std::vector<DomainPart> parts;
  if (band > 0 || share < kLeastShare || share > kMostShare) {
    parts.push_back({1, {field, sampleUniform(distance, field.domain(), band, options, progress)}});
    return parts;
  }
  for (const bool isExact : {false, true}) {
    SampleOptions part = options;
    part.count = isExact ? options.count / 4 : options.count - options.count / 4;
    part.where = [&field, isExact](const Vector3& x) { return (field.cellAt(x).degree == kExactDegree) == isExact; };
    parts.push_back({isExact ? 1 - share : share, {field, sampleUniform(distance, field.domain(), 0, part, progress)}});
  }
  return parts;
}

/// Returns the errors over all parts of the domain.
Measurement::Error errorOver(const std::vector<DomainPart>& parts) {
  Measurement::Error error;
  double square = 0;
  for (const DomainPart& part : parts) {
    square += part.share * part.errors.sums.rms() * part.errors.sums.rms();
    error.max = std::max(error.max, part.errors.sums.max);
  }
  error.rms = std::sqrt(square);
  return error;
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
  } catch (const NoSamplesError&) {
    return {};
  }
}

/// Returns how many points `measure` takes by default for a field whose construction evaluated Φ so many times.
std::size_t usualPoints(std::uint64_t evaluations, InsideTest insideTest) {
  // Winding numbers at random points take longer than at the points of a cell, which are evaluated together.
  const bool isSlow = insideTest == InsideTest::winding || insideTest == InsideTest::outerHull;
  return isSlow ? std::clamp<std::uint64_t>(evaluations / 40, 8'000, 50'000)
                : std::clamp<std::uint64_t>(evaluations / 20, 20'000, 100'000);
}

}  // namespace

Measurement measure(const Field& field, const DistanceFunction& distance, const MeasureOptions& options,
                    const Progress& progress) {
  // Signs near a surface that is exact but for rounding to float do not count as wrong.
  constexpr double kLeastThreshold = 1e-6;
  const FieldMetadata& metadata = field.metadata();
  const double length = metadata.referenceLength;
  Measurement result;
  const double within = std::min(allowedError(metadata.settings, length).within, field.domain().diagonal().norm() / 8);
  const double tolerance = metadata.settings.tolerance;
  const double usual = tolerance > 0 ? within : 0.01 * length;
  result.nearDistance = options.near > 0 ? options.near : usual;
  const std::size_t points =
      options.points > 0 ? options.points : usualPoints(metadata.exactEvaluations, distance.source().insideTest);
  const SampleOptions half{
      .count = std::max<std::size_t>(1, points / 2), .seed = options.seed, .threads = options.threads};
  SampleOptions other = half;
  other.seed = ~options.seed;
  const std::optional<TriangleMesh> surface = surfaceOf(distance);
  return withThreads(options.threads, [&] {
    const std::vector<DomainPart> parts = measureDomain(field, distance, half, detail::partOf(progress, 0, 0.45));
    const ErrorsAtPoints near(field, samplesNear(distance, surface, field.domain(), result.nearDistance, other,
                                                 detail::partOf(progress, 0.45, 0.9)));
    result.points = near.values.size();
    result.near = {near.sums.rms(), near.sums.max};
    result.domain = errorOver(parts);
    result.signThreshold = tolerance > 0 ? tolerance : std::max(10 * result.near.rms, kLeastThreshold * length);
    const AllowedError allowed = allowedError(metadata.settings, length);
    double greatest = -1;
    addPoints(result, greatest, near, allowed);
    for (const DomainPart& part : parts) {
      result.points += part.errors.values.size();
      addPoints(result, greatest, part.errors, allowed);
    }
    progress.update("measuring", 0.95);
    SampleOptions quarter = half;
    quarter.count = std::max<std::size_t>(1, points / 4);
    if (surface) result.tornShare = tornShare(field, *surface, quarter);
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

Field measured(Field field, const DistanceFunction& distance, const BuildOptions& options, const Progress& progress) {
  const MeasureOptions points{.near = options.targetError.byDistance().nearDistance, .threads = options.threads};
  const Measurement measurement = measure(field, distance, points, progress);
  return withMeasurement(std::move(field), measurement);
}

}  // namespace hpsdf
