// A field that is accurate near the surface: high nearness, coefficients as float.

#include <optional>

#include "scene.h"

namespace hpsdf::bench {
namespace {

void nearSurface(benchmark::State& state) {
  const TriangleMesh& mesh = bunny();
  // Found by trials: so high a nearness would leave the far field to the base cells, hence a finer grid; cells at the
  // surface are small and of low degree whatever is allowed, and are found sooner where no more is tried.
  const BuildOptions options{.targetError = 1.4e-8,
                             .grid = {16, 16, 16},
                             .nearness = 256,
                             .maxDegree = 3,
                             .quadrature = 2,
                             .coefficients = CoefficientType::float32};
  std::optional<Field> field;
  for ([[maybe_unused]] auto _ : state) field = build(ExactDistance(mesh), paperDomain(), options);
  const std::vector<Vector3> points = nearPoints(200'000, 0.02);
  std::vector<double> values(points.size());
  field->values(points, values);
  state.counters["bytes"] = double(field->bytes());
  state.counters["rms"] = rmsError(points, values);
}

BENCHMARK(nearSurface)->Name("near/ours")->MeasureProcessCPUTime()->UseRealTime()->Iterations(1);

}  // namespace
}  // namespace hpsdf::bench
