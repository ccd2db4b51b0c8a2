// Benchmarks of exact signed distances on one thread.

#include <algorithm>
#include <span>

#include "peer_points.h"

namespace hpsdf::bench {
namespace {

/// The exact distance to the bunny, which keeps the points at which it is asked for by one thread.
class RecordingDistance {
 public:
  explicit RecordingDistance(ConstructionPoints& all) : all_(&all) {}

  void operator()(std::span<const Vector3> points, std::span<double> out) const {
    keep(points, false);
    bunnyDistance()(points, out);
  }
  void withGradients(std::span<const Vector3> points, std::span<double> out, std::span<Vector3> gradients) const {
    keep(points, true);
    bunnyDistance().withGradients(points, out, gradients);
  }
  bool hasGradients() const { return bunnyDistance().hasGradients(); }
  Source source() const { return bunnyDistance().source(); }

 private:
  void keep(std::span<const Vector3> points, bool withGradients) const {
    all_->points.insert(all_->points.end(), points.begin(), points.end());
    all_->batches.push_back({points.size(), withGradients});
  }

  ConstructionPoints* all_;
};

/// Returns all points at which the construction of the bunny's field asks for the distance.
ConstructionPoints record() {
  ConstructionPoints all;
  build(RecordingDistance(all), paperDomain(), {.targetError = 1e-6, .threads = 1});
  return all;
}

/// Returns every n-th batch, with n chosen such that about `count` points remain.
ConstructionPoints thinned(const ConstructionPoints& all, std::size_t count) {
  const std::size_t every = std::max<std::size_t>(1, all.points.size() / count);
  ConstructionPoints result;
  auto first = all.points.begin();
  for (std::size_t i = 0; i < all.batches.size(); ++i) {
    const auto last = first + std::ptrdiff_t(all.batches[i].size);
    if (i % every == 0) {
      result.points.insert(result.points.end(), first, last);
      result.batches.push_back(all.batches[i]);
    }
    first = last;
  }
  return result;
}

/// Times evaluate(batch, its first point, its points) for all batches of the construction.
template <typename Evaluate>
void timeBatches(benchmark::State& state, const Evaluate& evaluate) {
  const auto& [points, batches] = constructionPoints();
  timeEach(state, points.size(), [&, &points = points, &batches = batches] {
    std::size_t first = 0;
    for (const Batch& batch : batches) {
      evaluate(batch, first, std::span(points).subspan(first, batch.size));
      first += batch.size;
    }
  });
}

void construction(benchmark::State& state) {
  const ExactDistance& distance = bunnyDistance();
  std::vector<double> out(constructionPoints().points.size());
  std::vector<Vector3> gradients(out.size());
  timeBatches(state, [&](const Batch& batch, std::size_t first, std::span<const Vector3> at) {
    const std::span values = std::span(out).subspan(first, batch.size);
    if (batch.withGradients)
      distance.withGradients(at, values, std::span(gradients).subspan(first, batch.size));
    else
      distance(at, values);
  });
}

/// The distances alone at the construction's points, with which the row of closest points is compared.
void distancesAlone(benchmark::State& state) {
  const ExactDistance& distance = bunnyDistance();
  std::vector<double> out(constructionPoints().points.size());
  timeBatches(state, [&](const Batch& batch, std::size_t first, std::span<const Vector3> at) {
    distance(at, std::span(out).subspan(first, batch.size));
  });
}

void closestPoints(benchmark::State& state) {
  const ExactDistance& distance = bunnyDistance();
  std::vector<ClosestPoint> out(constructionPoints().points.size());
  timeBatches(state, [&](const Batch& batch, std::size_t first, std::span<const Vector3> at) {
    distance.closestPoints(at, std::span(out).subspan(first, batch.size));
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
BENCHMARK(distancesAlone)->Name("distance/construction/distances_alone");
BENCHMARK(closestPoints)->Name("distance/construction/closest_points");
BENCHMARK(uniform)->Name("distance/uniform/ours");

}  // namespace

const ConstructionPoints& constructionPoints() {
  static const ConstructionPoints points = thinned(record(), 300'000);
  return points;
}

}  // namespace hpsdf::bench
