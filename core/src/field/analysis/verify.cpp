#include "hpsdf/verify.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>
#include <tuple>

#include "field/query/evaluate.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "util/chunks.h"

namespace hpsdf {
namespace {

/// Number of samples in a chunk. Sums are added chunk by chunk, so that the number of threads does not change the
/// rounding.
constexpr std::size_t kPointsPerTask = 4096;

detail::Sums sumsOf(std::span<const double> values) {
  const auto add = [&](detail::Sums& sums, std::size_t first, std::size_t count) {
    for (const double x : values.subspan(first, count)) sums.add(x);
  };
  return detail::sumOfChunks<detail::Sums>(values.size(), kPointsPerTask, {}, "", add);
}

/// Returns a percentile of values in ascending order: the least value that at least `percent` percent of the
/// values do not exceed.
double percentile(std::span<const double> ascending, double percent) {
  const double rank = std::ceil(percent / 100 * static_cast<double>(ascending.size()));
  return ascending[std::clamp<std::size_t>(static_cast<std::size_t>(rank), 1, ascending.size()) - 1];
}

ErrorFigures errorFigures(std::vector<double> errors) {
  ErrorFigures figures{.samples = errors.size()};
  if (errors.empty()) return figures;
  const detail::Sums sums = sumsOf(errors);
  figures.rms = sums.rms();
  figures.mean = sums.mean();
  figures.max = sums.max;
  tbb::parallel_sort(errors.begin(), errors.end());
  for (const double percent : {50.0, 90.0, 99.0, 99.9}) figures.percentiles[percent] = percentile(errors, percent);
  return figures;
}

std::vector<double> errorsOf(std::span<const ValueAndGradient> found, std::span<const double> exact) {
  std::vector<double> errors(found.size());
  for (std::size_t n = 0; n < found.size(); ++n) errors[n] = std::abs(found[n].value - exact[n]);
  return errors;
}

std::vector<ValueAndGradient> fieldAt(const Field& field, std::span<const Vector3> points) {
  std::vector<ValueAndGradient> found(points.size());
  detail::forEachChunk(points.size(), kPointsPerTask, [&](std::size_t, std::size_t first, std::size_t count) {
    field.valuesAndGradients(points.subspan(first, count), std::span(found).subspan(first, count));
  });
  return found;
}

bool signsDiffer(double f, double exact) { return (f < 0 && exact > 0) || (f > 0 && exact < 0); }

SignFigures signFigures(std::span<const ValueAndGradient> found, std::span<const double> exact, double threshold) {
  SignFigures figures{.threshold = threshold};
  for (std::size_t n = 0; n < found.size(); ++n) {
    if (!signsDiffer(found[n].value, exact[n])) continue;
    const double distance = std::abs(exact[n]);
    ++figures.mismatches;
    figures.farthest = std::max(figures.farthest, distance);
    figures.defects += distance > threshold;
  }
  return figures;
}

double angleDegrees(const Vector3& a, const Vector3& b) {
  return 180 / std::numbers::pi * std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Returns the angles between the gradients of the field and of the exact distance at about `wanted` samples,
/// chosen with a constant stride.
std::vector<double> anglesAt(const VerifiedSurface& surface, const ExactSamples& samples,
                             std::span<const ValueAndGradient> found, std::size_t wanted, const Progress& progress) {
  if (wanted == 0) return {};
  const std::size_t stride = std::max<std::size_t>(1, samples.points.size() / wanted);
  std::vector<double> angles((samples.points.size() + stride - 1) / stride, -1.0);
  detail::forEachChunk(angles.size(), kPointsPerTask, [&](std::size_t, std::size_t first, std::size_t count) {
    progress.throwIfCancelled();
    for (std::size_t n = first; n < first + count; ++n) {
      const std::size_t at = n * stride;
      const Vector3 normal = surface.normal(samples.points[at], samples.distances[at]);
      if (normal.squaredNorm() > 0 && found[at].gradient.squaredNorm() > 0)
        angles[n] = angleDegrees(found[at].gradient, normal);
    }
  });
  std::erase(angles, -1.0);
  return angles;
}

GradientFigures gradientFigures(const ExactSamples& samples, std::span<const ValueAndGradient> found,
                                std::vector<double> angles) {
  GradientFigures figures{.angles = angles.size()};
  std::vector<double> lengths(found.size()), deviations(found.size()), slopes(found.size(), 0.0);
  detail::forEachChunk(found.size(), kPointsPerTask, [&](std::size_t, std::size_t first, std::size_t count) {
    for (std::size_t n = first; n < first + count; ++n) {
      lengths[n] = found[n].gradient.norm();
      deviations[n] = std::abs(lengths[n] - 1);
      if (n == 0) continue;
      const double distance = (samples.points[n] - samples.points[n - 1]).norm();
      if (distance > 0) slopes[n] = std::abs(found[n].value - found[n - 1].value) / distance;
    }
  });
  if (!found.empty()) {
    const detail::Sums lengthSums = sumsOf(lengths);
    figures.meanLength = lengthSums.mean();
    figures.maxLength = lengthSums.max;
    figures.lengthErrorRms = sumsOf(deviations).rms();
    figures.maxPairSlope = sumsOf(slopes).max;
  }
  if (!angles.empty()) {
    tbb::parallel_sort(angles.begin(), angles.end());
    figures.meanAngleDegrees = sumsOf(angles).mean();
    figures.angle99Degrees = percentile(angles, 99);
    figures.maxAngleDegrees = angles.back();
  }
  return figures;
}

/// Random points, all uniform or all near the surface, with the field's values and gradients at the points.
struct Sampled {
  ExactSamples samples;
  std::vector<ValueAndGradient> found;
};

/// Returns the `count` points with the greatest errors, greatest first, and at most one point of each cell.
std::vector<WorstPoint> worstPoints(const Field& field, std::span<const Sampled* const> kinds, std::size_t count) {
  struct Candidate {
    double error;
    std::size_t kind, sample;
  };
  std::vector<Candidate> candidates;
  for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
    const auto& [samples, found] = *kinds[kind];
    for (std::size_t n = 0; n < found.size(); ++n)
      candidates.push_back({std::abs(found[n].value - samples.distances[n]), kind, n});
  }
  tbb::parallel_sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return std::tuple(b.error, a.kind, a.sample) < std::tuple(a.error, b.kind, b.sample);
  });
  std::vector<WorstPoint> worst;
  std::set<std::uint32_t> seen;
  for (const Candidate& candidate : candidates) {
    if (worst.size() >= count) break;
    const auto& [samples, found] = *kinds[candidate.kind];
    const Vector3& x = samples.points[candidate.sample];
    const Cell cell = field.cellAt(x);
    if (!seen.insert(cell.id).second) continue;
    worst.push_back(
        {x, samples.distances[candidate.sample], found[candidate.sample].value, cell.id, cell.degree, cell.depth});
  }
  return worst;
}

/// Compares the errors and slopes at the samples with the proven bounds of the cells that hold the samples.
BoundFigures boundFigures(const FieldData& field, std::span<const Sampled* const> kinds) {
  constexpr double kNoSample = -1;
  BoundFigures figures;
  std::vector<double> worstOfCell(field.nodes.size(), kNoSample);
  const GridFrame frame = query::gridFrame(field);
  for (const Sampled* kind : kinds)
    for (std::size_t n = 0; n < kind->found.size(); ++n) {
      const std::uint32_t cell = query::findLeafNode(field, query::gridPoint(frame, kind->samples.points[n])).node;
      const double error = std::abs(kind->found[n].value - kind->samples.distances[n]);
      worstOfCell[cell] = std::max(worstOfCell[cell], error);
      figures.violations +=
          error > field.bounds[cell].error || kind->found[n].gradient.norm() > field.bounds[cell].slope;
    }
  std::vector<double> bounds, worst;
  for (std::size_t cell = 0; cell < worstOfCell.size(); ++cell) {
    if (worstOfCell[cell] == kNoSample) continue;
    bounds.push_back(field.bounds[cell].error);
    worst.push_back(worstOfCell[cell]);
  }
  tbb::parallel_sort(bounds.begin(), bounds.end());
  tbb::parallel_sort(worst.begin(), worst.end());
  figures.cells = bounds.size();
  figures.medianBound = percentile(bounds, 50);
  figures.medianWorst = percentile(worst, 50);
  return figures;
}

void checkOptions(const VerifyOptions& options) {
  if (options.points < 2) throw Error("verify: too few points; give 2 or more");
  for (const double length : {options.near, options.band, options.signBound})
    if (!(length >= 0) || !std::isfinite(length))
      throw Error("verify: a length is below 0 or not finite; give near, band and sign bound as 0 or more");
}

}  // namespace

ErrorFigures measureError(std::span<const double> values, std::span<const double> distances, int threads) {
  std::vector<double> errors(values.size());
  for (std::size_t n = 0; n < errors.size(); ++n) errors[n] = std::abs(values[n] - distances[n]);
  return withThreads(threads, [&] { return errorFigures(std::move(errors)); });
}

ErrorFigures measureError(const Field& field, const ExactSamples& samples, int threads) {
  std::vector<double> values(samples.points.size());
  withThreads(threads, [&] {
    detail::forEachChunk(values.size(), kPointsPerTask, [&](std::size_t, std::size_t first, std::size_t count) {
      field.values(std::span(samples.points).subspan(first, count), std::span(values).subspan(first, count));
    });
  });
  return measureError(values, samples.distances, threads);
}

Verification verify(const Field& field, const VerifiedSurface& surface, const VerifyOptions& options,
                    const Progress& progress) {
  checkOptions(options);
  Verification result;
  result.near = options.near > 0 ? options.near : 0.01 * boundingBox(surface.mesh).sizes().maxCoeff();
  if (options.band > 0) result.near = std::min(result.near, options.band);

  // Draw the uniform samples and the samples near the surface. The latter get a seed of their own so that they do
  // not repeat the pattern of the uniform ones.
  const std::size_t half = options.points / 2;
  Sampled uniform, near;
  uniform.samples = sampleUniform(surface.distance, field.domain(), options.band,
                                  {.count = options.points - half, .seed = options.seed, .threads = options.threads},
                                  detail::partOf(progress, 0, 0.5));
  near.samples = sampleNear(surface.distance, surface.mesh, field.domain(), result.near,
                            {.count = half, .seed = ~options.seed, .threads = options.threads},
                            detail::partOf(progress, 0.5, 0.8));

  return withThreads(options.threads, [&] {
    for (Sampled* kind : {&uniform, &near}) kind->found = fieldAt(field, kind->samples.points);
    result.uniform.error = errorFigures(errorsOf(uniform.found, uniform.samples.distances));
    result.nearSurface.error = errorFigures(errorsOf(near.found, near.samples.distances));
    const double threshold = options.signBound > 0 ? options.signBound : 10 * result.nearSurface.error.rms;
    progress.update("comparing gradients", 0.8);
    for (const auto& [kind, figures] : {std::pair(&uniform, &result.uniform), std::pair(&near, &result.nearSurface)}) {
      figures->signs = signFigures(kind->found, kind->samples.distances, threshold);
      figures->gradient = gradientFigures(
          kind->samples, kind->found, anglesAt(surface, kind->samples, kind->found, options.anglePoints / 2, progress));
    }
    const std::array<const Sampled*, 2> kinds = {&uniform, &near};
    if (!field.data().bounds.empty()) result.bounds = boundFigures(field.data(), kinds);
    result.worst = worstPoints(field, kinds, options.worst);
    return result;
  });
}

}  // namespace hpsdf
