#include "hpsdf/verify.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>

#include "field/query/evaluate.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "util/chunks.h"
#include "util/sums.h"

namespace hpsdf {
namespace {

constexpr std::size_t kChunk = 4096;  // samples whose sums are taken together, whatever the number of threads
constexpr double kDegrees = 180 / std::numbers::pi;

Sums sumsOf(std::span<const double> values) {
  std::vector<Sums> parts(chunksOf(values.size(), kChunk));
  forEachChunk(values.size(), kChunk, [&](std::size_t chunk, std::size_t first, std::size_t count) {
    for (const double x : values.subspan(first, count)) parts[chunk].add(x);
  });
  Sums all;
  for (const Sums& part : parts) all.add(part);
  return all;
}

/// Of ascending values, the least that so many percent of them do not exceed.
double percentile(std::span<const double> ascending, double percent) {
  const double rank = std::ceil(percent / 100 * static_cast<double>(ascending.size()));
  return ascending[std::clamp<std::size_t>(static_cast<std::size_t>(rank), 1, ascending.size()) - 1];
}

ErrorFigures errorFigures(std::vector<double> errors) {
  ErrorFigures figures{.samples = errors.size()};
  if (errors.empty()) return figures;
  const Sums sums = sumsOf(errors);
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
  forEachChunk(points.size(), kChunk, [&](std::size_t, std::size_t first, std::size_t count) {
    field.valuesAndGradients(points.subspan(first, count), std::span(found).subspan(first, count));
  });
  return found;
}

bool signsDiffer(double f, double exact) { return (f < 0 && exact > 0) || (f > 0 && exact < 0); }

SignFigures signFigures(std::span<const ValueAndGradient> found, std::span<const double> exact, double bound) {
  SignFigures figures{.beyond = bound};
  for (std::size_t n = 0; n < found.size(); ++n) {
    if (!signsDiffer(found[n].value, exact[n])) continue;
    const double distance = std::abs(exact[n]);
    ++figures.mismatches;
    figures.deepest = std::max(figures.deepest, distance);
    figures.beyondCount += distance > bound;
  }
  return figures;
}

double angleDegrees(const Vector3& a, const Vector3& b) { return kDegrees * std::atan2(a.cross(b).norm(), a.dot(b)); }

/// Angles between the gradients at every so manieth sample.
std::vector<double> anglesAt(const VerifiedSurface& surface, const ExactSamples& samples,
                             std::span<const ValueAndGradient> found, std::size_t wanted, const Progress& progress) {
  if (wanted == 0) return {};
  const std::size_t stride = std::max<std::size_t>(1, samples.points.size() / wanted);
  std::vector<double> angles((samples.points.size() + stride - 1) / stride, -1.0);
  forEachChunk(angles.size(), kChunk, [&](std::size_t, std::size_t first, std::size_t count) {
    progress.pause();
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
  forEachChunk(found.size(), kChunk, [&](std::size_t, std::size_t first, std::size_t count) {
    for (std::size_t n = first; n < first + count; ++n) {
      lengths[n] = found[n].gradient.norm();
      deviations[n] = std::abs(lengths[n] - 1);
      if (n == 0) continue;
      const double apart = (samples.points[n] - samples.points[n - 1]).norm();
      if (apart > 0) slopes[n] = std::abs(found[n].value - found[n - 1].value) / apart;
    }
  });
  if (!found.empty()) {
    const Sums ofLengths = sumsOf(lengths);
    figures.meanLength = ofLengths.mean();
    figures.maxLength = ofLengths.max;
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

/// Of each cell its worst point, the worst of these first.
std::vector<WorstPoint> worstPoints(const Field& field, std::span<const ExactSamples* const> samples,
                                    std::span<const std::vector<ValueAndGradient>* const> found, std::size_t count) {
  struct Candidate {
    double error;
    std::size_t kind, sample;
  };
  std::vector<Candidate> candidates;
  for (std::size_t kind = 0; kind < samples.size(); ++kind)
    for (std::size_t n = 0; n < found[kind]->size(); ++n)
      candidates.push_back({std::abs((*found[kind])[n].value - samples[kind]->distances[n]), kind, n});
  tbb::parallel_sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    if (a.error != b.error) return a.error > b.error;
    return a.kind != b.kind ? a.kind < b.kind : a.sample < b.sample;
  });
  std::vector<WorstPoint> worst;
  std::set<std::uint32_t> seen;
  for (const Candidate& at : candidates) {
    if (worst.size() >= count) break;
    const Vector3& x = samples[at.kind]->points[at.sample];
    const Cell cell = field.cellAt(x);
    if (!seen.insert(cell.id).second) continue;
    worst.push_back({x, samples[at.kind]->distances[at.sample], (*found[at.kind])[at.sample].value, cell.id,
                     cell.degree, cell.depth});
  }
  return worst;
}

/// Samples beyond their cell's bound, and the greatest error by cell: -1 for those without a sample.
struct HeldAgainst {
  std::size_t violations = 0;
  std::vector<double> worst;
};

void holdAgainst(const FieldData& field, const ExactSamples& samples, std::span<const ValueAndGradient> found,
                 HeldAgainst& held) {
  const GridFrame frame = gridFrame(field);
  for (std::size_t n = 0; n < found.size(); ++n) {
    const std::uint32_t cell = locate(field, gridPoint(frame, samples.points[n])).node;
    const double error = std::abs(found[n].value - samples.distances[n]);
    held.worst[cell] = std::max(held.worst[cell], error);
    held.violations += error > field.bounds[cell].error || found[n].gradient.norm() > field.bounds[cell].slope;
  }
}

BoundFigures boundFigures(const FieldData& field, const HeldAgainst& held) {
  std::vector<double> bounds, worst;
  for (std::size_t cell = 0; cell < held.worst.size(); ++cell) {
    if (held.worst[cell] < 0) continue;
    bounds.push_back(field.bounds[cell].error);
    worst.push_back(held.worst[cell]);
  }
  tbb::parallel_sort(bounds.begin(), bounds.end());
  tbb::parallel_sort(worst.begin(), worst.end());
  return {held.violations, bounds.size(), percentile(bounds, 50), percentile(worst, 50)};
}

void checkOptions(const VerifyOptions& options) {
  if (options.points < 2) throw Error("verify: too few points; give 2 or more");
  for (const double length : {options.near, options.band, options.signBound})
    if (!(length >= 0) || !std::isfinite(length))
      throw Error("verify: a length is below 0 or not finite; give near, band and sign bound as 0 or more");
}

/// A share of the whole progress.
Progress part(const Progress& progress, double from, double to) {
  if (!progress.report) return progress;
  return {.report = [&progress, from, to](std::string_view task,
                                          double done) { progress.report(task, from + done * (to - from)); },
          .cancelled = progress.cancelled};
}

}  // namespace

ErrorFigures measureError(const Field& field, const ExactSamples& samples, int threads) {
  return withThreads(threads, [&] {
    std::vector<double> values(samples.points.size());
    forEachChunk(values.size(), kChunk, [&](std::size_t, std::size_t first, std::size_t count) {
      field.values(std::span(samples.points).subspan(first, count), std::span(values).subspan(first, count));
      for (std::size_t n = first; n < first + count; ++n) values[n] = std::abs(values[n] - samples.distances[n]);
    });
    return errorFigures(std::move(values));
  });
}

Verification verify(const Field& field, const VerifiedSurface& surface, const VerifyOptions& options,
                    const Progress& progress) {
  checkOptions(options);
  Verification result;
  result.near = options.near > 0 ? options.near : 0.01 * boundingBox(surface.mesh).sizes().maxCoeff();
  if (options.band > 0) result.near = std::min(result.near, options.band);
  const std::size_t half = options.points / 2;
  const ExactSamples uniform = sampleUniform(
      surface.distance, field.domain(), options.band,
      {.count = options.points - half, .seed = options.seed, .threads = options.threads}, part(progress, 0, 0.5));
  // a seed of its own, so that near points do not repeat the pattern of the others
  const ExactSamples near =
      sampleNear(surface.distance, surface.mesh, field.domain(), result.near,
                 {.count = half, .seed = ~options.seed, .threads = options.threads}, part(progress, 0.5, 0.8));
  return withThreads(options.threads, [&] {
    const std::vector<ValueAndGradient> atUniform = fieldAt(field, uniform.points);
    const std::vector<ValueAndGradient> atNear = fieldAt(field, near.points);
    result.uniform.error = errorFigures(errorsOf(atUniform, uniform.distances));
    result.nearSurface.error = errorFigures(errorsOf(atNear, near.distances));
    const double bound = options.signBound > 0 ? options.signBound : 10 * result.nearSurface.error.rms;
    result.uniform.signs = signFigures(atUniform, uniform.distances, bound);
    result.nearSurface.signs = signFigures(atNear, near.distances, bound);
    progress.at("comparing gradients", 0.8);
    const std::size_t anglesOfEach = options.anglePoints / 2;
    result.uniform.gradient =
        gradientFigures(uniform, atUniform, anglesAt(surface, uniform, atUniform, anglesOfEach, progress));
    result.nearSurface.gradient =
        gradientFigures(near, atNear, anglesAt(surface, near, atNear, anglesOfEach, progress));
    if (!field.data().bounds.empty()) {
      HeldAgainst held{.worst = std::vector<double>(field.data().nodes.size(), -1.0)};
      holdAgainst(field.data(), uniform, atUniform, held);
      holdAgainst(field.data(), near, atNear, held);
      result.bounds = boundFigures(field.data(), held);
    }
    result.worst = worstPoints(field, std::array{&uniform, &near}, std::array{&atUniform, &atNear}, options.worst);
    return result;
  });
}

}  // namespace hpsdf
