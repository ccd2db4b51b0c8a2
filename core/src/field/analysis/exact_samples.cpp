#include "hpsdf/detail/exact_samples.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "field/cells/cell_fit.h"
#include "hpsdf/detail/random_points.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "mesh/area_points.h"
#include "util/chunks.h"
#include "util/morton_order.h"

namespace hpsdf {
namespace {

/// Number of points for which the exact distance is computed at once.
constexpr std::size_t kBatch = 512;

/// Drawing random samples fails if an accepted sample takes more candidate points than this on average.
constexpr std::size_t kMaxCandidates = 1000;

template <typename T>
std::vector<T> permuted(const std::vector<T>& items, const std::vector<std::uint32_t>& order) {
  std::vector<T> result(items.size());
  for (std::size_t n = 0; n < items.size(); ++n) result[n] = items[order[n]];
  return result;
}

/// Computes the exact distances of points, which may come in any order. Throws `Error` if a distance is not finite.
std::vector<double> distancesAt(const DistanceFunction& distance, const std::vector<Vector3>& points, const Box& domain,
                                const Progress& progress) {
  const std::vector<std::uint32_t> order = detail::mortonOrder(points, domain);
  std::vector<double> distances(points.size());
  const auto computeChunk = [&](std::size_t, std::size_t first, std::size_t count) {
    std::array<Vector3, kBatch> at;
    std::array<double, kBatch> found;
    for (std::size_t n = 0; n < count; ++n) at[n] = points[order[first + n]];
    distance(std::span(at).first(count), std::span(found).first(count));
    for (std::size_t n = 0; n < count; ++n) distances[order[first + n]] = found[n];
  };
  detail::forEachChunk(points.size(), kBatch, progress, "taking exact distances", computeChunk);
  detail::requireFinite(points, distances);
  return distances;
}

/// Draws candidate points draw(0), draw(1), … until `options.count` of them are accepted. A candidate must lie
/// in the domain and, if `band` is above 0, in the narrow band. Throws `NoSamplesError` with `noneMessage` if too few
/// candidates are accepted.
template <typename Draw>
ExactSamples drawSamples(const DistanceFunction& distance, const Box& domain, double band, const SampleOptions& options,
                         const Progress& progress, const std::string& noneMessage, const Draw& draw) {
  if (options.count >= std::size_t{1} << 32) throw Error("too many points; give fewer than 4,294,967,296");
  ExactSamples samples;
  for (std::size_t drawn = 0; samples.points.size() < options.count;) {
    if (drawn > kMaxCandidates * (samples.points.size() + 1)) throw NoSamplesError(noneMessage);
    const std::size_t missing = options.count - samples.points.size();
    std::vector<Vector3> round(drawn == 0 ? missing : 2 * missing);
    tbb::parallel_for(std::size_t{0}, round.size(), [&](std::size_t n) { round[n] = draw(drawn + n); });
    drawn += round.size();
    std::erase_if(round, [&](const Vector3& x) { return !domain.contains(x) || (options.where && !options.where(x)); });
    const std::vector<double> distances = distancesAt(distance, round, domain, progress);
    for (std::size_t n = 0; n < round.size() && samples.points.size() < options.count; ++n) {
      if (band > 0 && std::abs(distances[n]) > band) continue;
      samples.points.push_back(round[n]);
      samples.distances.push_back(distances[n]);
    }
  }
  const std::vector<std::uint32_t> order = detail::mortonOrder(samples.points, domain);
  return {permuted(samples.points, order), permuted(samples.distances, order)};
}

/// Divides the domain into blocks and returns the blocks that may intersect the narrow band. All other blocks lie
/// outside the band, because the exact distance is 1-Lipschitz.
std::vector<Box> blocksInBand(const DistanceFunction& distance, const Box& domain, double band) {
  constexpr int kBlocks = 32;  // along each axis
  const Vector3 size = domain.sizes() / kBlocks;
  std::vector<Box> blocks;
  std::vector<Vector3> centers;
  for (int z = 0; z < kBlocks; ++z)
    for (int y = 0; y < kBlocks; ++y)
      for (int x = 0; x < kBlocks; ++x) {
        const Vector3 lo = domain.min() + size.cwiseProduct(Vector3(x, y, z));
        blocks.emplace_back(lo, lo + size);
        centers.push_back(blocks.back().center());
      }
  const std::vector<double> distances = distancesAt(distance, centers, domain, {});
  std::vector<Box> inBand;
  for (std::size_t n = 0; n < blocks.size(); ++n)
    if (std::abs(distances[n]) <= band + size.norm() / 2) inBand.push_back(blocks[n]);
  return inBand;
}

}  // namespace

ExactSamples sampleUniform(const DistanceFunction& distance, const Box& domain, double band,
                           const SampleOptions& options, const Progress& progress) {
  const std::string noneMessage = "hardly any point of the domain was found within the band; give a wider one";
  return withThreads(options.threads, [&] {
    if (!(band > 0))
      return drawSamples(distance, domain, band, options, progress, noneMessage,
                         [&](std::uint64_t n) { return detail::Random(options.seed, n).inBox(domain); });
    const std::vector<Box> blocks = blocksInBand(distance, domain, band);
    if (blocks.empty()) throw NoSamplesError(noneMessage);
    return drawSamples(distance, domain, band, options, progress, noneMessage, [&](std::uint64_t n) {
      detail::Random random(options.seed, n);
      const double block = random.unit() * static_cast<double>(blocks.size());
      return random.inBox(blocks[static_cast<std::size_t>(block)]);
    });
  });
}

std::vector<Vector3> sampleSurface(const TriangleMesh& surface, const Box& domain, const SampleOptions& options) {
  const mesh::AreaPoints surfacePoints(surface);
  return withThreads(options.threads, [&] {
    std::vector<Vector3> points(options.count);
    tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t n) {
      detail::Random random(options.seed, n);
      points[n] = surfacePoints.draw(random);
    });
    std::erase_if(points, [&](const Vector3& x) { return !domain.contains(x); });
    return permuted(points, detail::mortonOrder(points, domain));
  });
}

ExactSamples sampleNear(const DistanceFunction& distance, const TriangleMesh& surface, const Box& domain, double radius,
                        const SampleOptions& options, const Progress& progress) {
  const mesh::AreaPoints points(surface);
  return withThreads(options.threads, [&] {
    return drawSamples(
        distance, domain, 0, options, progress,
        "hardly any point near the surface lies in the domain: it misses the surface, or near means too far",
        [&](std::uint64_t n) {
          detail::Random random(options.seed, n);
          const Vector3 onSurface = points.draw(random);
          return Vector3(onSurface + random.inBall(radius));
        });
  });
}

}  // namespace hpsdf
