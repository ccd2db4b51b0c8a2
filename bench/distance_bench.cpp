// Benchmarks of exact signed distances on one thread.

#include <algorithm>
#include <span>

#include "peer_points.h"

namespace hpsdf::bench {
namespace {

/// Returns all points at which the construction of the bunny's field asks for the distance.
ConstructionPoints record() {
  ConstructionPoints all;
  const auto recording = [&all](std::span<const Vector3> points, std::span<double> out) {
    all.points.insert(all.points.end(), points.begin(), points.end());
    all.batches.push_back(points.size());
    bunnyDistance()(points, out);
  };
  build(recording, paperDomain(), {.targetError = 1e-5, .threads = 1});
  return all;
}

/// Returns every n-th batch, with n chosen such that about `count` points remain.
ConstructionPoints thinned(const ConstructionPoints& all, std::size_t count) {
  const std::size_t every = std::max<std::size_t>(1, all.points.size() / count);
  ConstructionPoints result;
  auto first = all.points.begin();
  for (std::size_t i = 0; i < all.batches.size(); ++i) {
    const auto last = first + std::ptrdiff_t(all.batches[i]);
    if (i % every == 0) {
      result.points.insert(result.points.end(), first, last);
      result.batches.push_back(all.batches[i]);
    }
    first = last;
  }
  return result;
}

void construction(benchmark::State& state) {
  const auto& [points, batches] = constructionPoints();
  const ExactDistance& distance = bunnyDistance();
  std::vector<double> out(points.size());
  timeEach(state, points.size(), [&, &points = points, &batches = batches] {
    std::size_t first = 0;
    for (const std::size_t size : batches) {
      distance(std::span(points).subspan(first, size), std::span(out).subspan(first, size));
      first += size;
    }
  });
}

void uniform(benchmark::State& state) {
  const std::vector<Vector3> points = uniformPoints(kUniformPoints);
  const ExactDistance& distance = bunnyDistance();
  std::vector<double> out(points.size());
  timeEach(state, points.size(), [&] {
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = distance(points[i]);
  });
}

BENCHMARK(construction)->Name("distance/construction/ours");
BENCHMARK(uniform)->Name("distance/uniform/ours");

}  // namespace

const ConstructionPoints& constructionPoints() {
  static const ConstructionPoints points = thinned(record(), 300'000);
  return points;
}

}  // namespace hpsdf::bench
