// Times of a field's queries at a million random points in random order, on one thread.

#include "hpsdf/continuity.h"
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

void batchedGradients(benchmark::State& state, const Field& field) {
  const std::vector<Vector3> points = uniformPoints(kPoints);
  std::vector<ValueAndGradient> out(kPoints);
  timeEach(state, kPoints, [&] { field.valuesAndGradients(points, out); });
}

/// Returns the bunny's field, blended with the default width of the blend zones.
const Field& blendedBunny() {
  static const Field field = blended(bunnyField());
  return field;
}

void bunnyValue(benchmark::State& state) { values(state, bunnyField()); }
void bunnyGradient(benchmark::State& state) { gradients(state, bunnyField()); }
void bunnyBatched(benchmark::State& state) { batched(state, bunnyField()); }
void bunnyBatchedGradient(benchmark::State& state) { batchedGradients(state, bunnyField()); }
void blendedValue(benchmark::State& state) { values(state, blendedBunny()); }
void blendedGradient(benchmark::State& state) { gradients(state, blendedBunny()); }
void blendedBatched(benchmark::State& state) { batched(state, blendedBunny()); }
void blendedBatchedGradient(benchmark::State& state) { batchedGradients(state, blendedBunny()); }
void armadilloValue(benchmark::State& state) { values(state, armadilloField()); }
void armadilloGradient(benchmark::State& state) { gradients(state, armadilloField()); }

BENCHMARK(bunnyValue)->Name("query/bunny/value");
BENCHMARK(bunnyGradient)->Name("query/bunny/gradient");
BENCHMARK(bunnyBatched)->Name("query/bunny/batched");
BENCHMARK(bunnyBatchedGradient)->Name("query/bunny/batched_gradient");
BENCHMARK(blendedValue)->Name("query/blended/value");
BENCHMARK(blendedGradient)->Name("query/blended/gradient");
BENCHMARK(blendedBatched)->Name("query/blended/batched");
BENCHMARK(blendedBatchedGradient)->Name("query/blended/batched_gradient");
BENCHMARK(armadilloValue)->Name("query/armadillo/value");
BENCHMARK(armadilloGradient)->Name("query/armadillo/gradient");

}  // namespace
}  // namespace hpsdf::bench
