// Queries of a field at a million random points in random order, by one thread.

#include "scene.h"

namespace hpsdf::bench {
namespace {

constexpr std::size_t kPoints = 1'000'000;

void values(benchmark::State& state, const Field& field) {
  const std::vector<Vector3> points = uniformPoints(kPoints);
  std::vector<double> out(kPoints);
  timeEach(state, kPoints, [&] {
    for (std::size_t i = 0; i < kPoints; ++i) out[i] = field.value(points[i]);
  });
}

void gradients(benchmark::State& state, const Field& field) {
  const std::vector<Vector3> points = uniformPoints(kPoints);
  std::vector<ValueAndGradient> out(kPoints);
  timeEach(state, kPoints, [&] {
    for (std::size_t i = 0; i < kPoints; ++i) out[i] = field.valueAndGradient(points[i]);
  });
}

void batched(benchmark::State& state, const Field& field) {
  const std::vector<Vector3> points = uniformPoints(kPoints);
  std::vector<double> out(kPoints);
  timeEach(state, kPoints, [&] { field.values(points, out); });
}

void bunnyValue(benchmark::State& state) { values(state, bunnyField()); }
void bunnyGradient(benchmark::State& state) { gradients(state, bunnyField()); }
void bunnyBatched(benchmark::State& state) { batched(state, bunnyField()); }
void armadilloValue(benchmark::State& state) { values(state, armadilloField()); }
void armadilloGradient(benchmark::State& state) { gradients(state, armadilloField()); }

BENCHMARK(bunnyValue)->Name("query/bunny/value");
BENCHMARK(bunnyGradient)->Name("query/bunny/gradient");
BENCHMARK(bunnyBatched)->Name("query/bunny/batched");
BENCHMARK(armadilloValue)->Name("query/armadillo/value");
BENCHMARK(armadilloGradient)->Name("query/armadillo/gradient");

}  // namespace
}  // namespace hpsdf::bench
