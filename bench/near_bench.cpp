// A field that is accurate near the surface alone: high nearness, coefficients as float.

#include <optional>

#include "scene.h"

namespace hpsdf::bench {
namespace {

void nearSurface(benchmark::State& state) {
  const TriangleMesh& mesh = bunny();
  const BuildOptions options{.targetError = 1e-7, .nearness = 64, .coefficients = CoefficientType::float32};
  std::optional<Field> field;
  for ([[maybe_unused]] auto _ : state) field = build(ExactDistance(mesh), paperDomain(), options);
  const std::vector<Vector3> points = nearPoints(200'000, 0.02);
  std::vector<double> values(points.size());
  field->values(points, values);
  state.counters["bytes"] = double(field->bytes());
  state.counters["rms"] = rmsError(points, values);
}

BENCHMARK(nearSurface)->Name("near/ours")->UseRealTime()->Iterations(1);

}  // namespace
}  // namespace hpsdf::bench
