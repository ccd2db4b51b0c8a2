#include "hpsdf/detail/exact_samples.h"

// Seeded points with their exact distances.

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <utility>

#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "util/chunks.h"
#include "util/random_points.h"

namespace hpsdf {
namespace {

constexpr std::size_t kBatch = 512;  // points handed to Φ at once
/// Where a point takes more candidates than this, the rest is not to be had.
constexpr std::size_t kMostCandidates = 1000;

/// Every third bit of a 64-bit number.
std::uint64_t spread(std::uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  x = (x | x << 2) & 0x1249249249249249;
  return x;
}

/// The order of points along a Morton curve through the domain: exact distances are fastest for neighbours.
std::vector<std::uint32_t> orderAlongCurve(std::span<const Vector3> points, const Box& domain) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(points.size());
  const Vector3 scale = domain.sizes().cwiseInverse() * double(1 << 21);
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t n) {
    const Vector3 at = (points[n] - domain.min()).cwiseProduct(scale).cwiseMax(0).cwiseMin((1 << 21) - 1);
    const auto bits = [&](int axis) { return spread(static_cast<std::uint64_t>(at[axis])) << axis; };
    keys[n] = {bits(0) | bits(1) | bits(2), static_cast<std::uint32_t>(n)};
  });
  tbb::parallel_sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> order(points.size());
  std::ranges::transform(keys, order.begin(), &std::pair<std::uint64_t, std::uint32_t>::second);
  return order;
}

template <typename T>
std::vector<T> arranged(const std::vector<T>& items, const std::vector<std::uint32_t>& order) {
  std::vector<T> result(items.size());
  for (std::size_t n = 0; n < items.size(); ++n) result[n] = items[order[n]];
  return result;
}

/// Φ at points in any order.
std::vector<double> distancesAt(const DistanceFunction& distance, const std::vector<Vector3>& points, const Box& domain,
                                const Progress& progress) {
  const std::vector<std::uint32_t> order = orderAlongCurve(points, domain);
  std::vector<double> distances(points.size());
  const auto take = [&](std::size_t, std::size_t first, std::size_t count) {
    std::array<Vector3, kBatch> at;
    std::array<double, kBatch> found;
    for (std::size_t n = 0; n < count; ++n) at[n] = points[order[first + n]];
    distance(std::span(at).first(count), std::span(found).first(count));
    for (std::size_t n = 0; n < count; ++n) distances[order[first + n]] = found[n];
  };
  forEachChunk(points.size(), kBatch, progress, "taking exact distances", take);
  for (std::size_t n = 0; n < points.size(); ++n) {
    if (std::isfinite(distances[n])) continue;
    std::ostringstream where;
    where << "the signed distance is not finite at (" << points[n].x() << ", " << points[n].y() << ", " << points[n].z()
          << "); it must be defined in the whole domain";
    throw Error(where.str());
  }
  return distances;
}

/// The first `count` candidates that lie in the domain and in the band; `draw(n)` is the n-th.
template <typename Draw>
ExactSamples drawSamples(const DistanceFunction& distance, const Box& domain, double band, const SampleOptions& options,
                         const Progress& progress, const std::string& noneMessage, const Draw& draw) {
  if (options.count >= std::size_t{1} << 32) throw Error("too many points; give fewer than 4,294,967,296");
  ExactSamples samples;
  for (std::size_t drawn = 0; samples.points.size() < options.count;) {
    if (drawn > kMostCandidates * (samples.points.size() + 1)) throw Error(noneMessage);
    const std::size_t missing = options.count - samples.points.size();
    std::vector<Vector3> round(drawn == 0 ? missing : 2 * missing);
    tbb::parallel_for(std::size_t{0}, round.size(), [&](std::size_t n) { round[n] = draw(drawn + n); });
    drawn += round.size();
    std::erase_if(round, [&](const Vector3& x) { return !domain.contains(x); });
    const std::vector<double> distances = distancesAt(distance, round, domain, progress);
    for (std::size_t n = 0; n < round.size() && samples.points.size() < options.count; ++n) {
      if (band > 0 && std::abs(distances[n]) > band) continue;
      samples.points.push_back(round[n]);
      samples.distances.push_back(distances[n]);
    }
  }
  const std::vector<std::uint32_t> order = orderAlongCurve(samples.points, domain);
  return {arranged(samples.points, order), arranged(samples.distances, order)};
}

/// The blocks of a regular division of the domain that the band may reach, Φ being 1-Lipschitz.
std::vector<Box> blocksInBand(const DistanceFunction& distance, const Box& domain, double band) {
  constexpr int kBlocks = 32;  // an axis
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
  std::vector<Box> reached;
  for (std::size_t n = 0; n < blocks.size(); ++n)
    if (std::abs(distances[n]) <= band + size.norm() / 2) reached.push_back(blocks[n]);
  return reached;
}

/// Points on a surface, uniform by area.
class SurfacePoints {
 public:
  explicit SurfacePoints(const TriangleMesh& mesh) : mesh_(mesh) {
    areas_.reserve(mesh.triangles.size());
    double area = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
      const Vector3& p = mesh.vertices[a];
      area += (mesh.vertices[b] - p).cross(mesh.vertices[c] - p).norm() / 2;
      areas_.push_back(area);
    }
    if (!(area > 0)) throw Error("points near the surface: the surface has no area");
  }

  Vector3 draw(Random& random) const {
    const auto found = std::upper_bound(areas_.begin(), areas_.end(), random.unit() * areas_.back());
    const std::size_t triangle = std::min(std::size_t(found - areas_.begin()), areas_.size() - 1);
    const auto& [a, b, c] = mesh_.triangles[triangle];
    const double side = std::sqrt(random.unit()), along = random.unit();
    return (1 - side) * mesh_.vertices[a] + side * (1 - along) * mesh_.vertices[b] + side * along * mesh_.vertices[c];
  }

 private:
  const TriangleMesh& mesh_;
  std::vector<double> areas_;  // of the triangles up to each
};

}  // namespace

ExactSamples sampleUniform(const DistanceFunction& distance, const Box& domain, double band,
                           const SampleOptions& options, const Progress& progress) {
  const std::string none = "hardly any point of the domain was found within the band; give a wider one";
  return withThreads(options.threads, [&] {
    if (!(band > 0))
      return drawSamples(distance, domain, band, options, progress, none,
                         [&](std::uint64_t n) { return Random(options.seed, n).inBox(domain); });
    const std::vector<Box> blocks = blocksInBand(distance, domain, band);
    if (blocks.empty()) throw Error(none);
    return drawSamples(distance, domain, band, options, progress, none, [&](std::uint64_t n) {
      Random random(options.seed, n);
      const double block = random.unit() * static_cast<double>(blocks.size());
      return random.inBox(blocks[static_cast<std::size_t>(block)]);
    });
  });
}

ExactSamples sampleNear(const DistanceFunction& distance, const TriangleMesh& surface, const Box& domain, double radius,
                        const SampleOptions& options, const Progress& progress) {
  const SurfacePoints points(surface);
  return withThreads(options.threads, [&] {
    return drawSamples(
        distance, domain, 0, options, progress,
        "hardly any point near the surface lies in the domain: it misses the surface, or near means too far",
        [&](std::uint64_t n) {
          Random random(options.seed, n);
          const Vector3 onSurface = points.draw(random);
          return Vector3(onSurface + random.inBall(radius));
        });
  });
}

}  // namespace hpsdf
