// Time and accuracy of a field that is accurate near the surface: high nearness exponent.

#include <optional>

#include "scene.h"

namespace hpsdf::bench {
namespace {

void nearSurface(benchmark::State& state) {
  const TriangleMesh& mesh = bunny();
  // These values were found by trials. With so high a nearness exponent, cells far from the surface are not refined;
  // hence the fine grid. Cells at the surface become small and of low degree anyway; low limits save trials.
  const BuildOptions options{
      .targetError = 1.1e-8, .grid = {16, 16, 16}, .nearness = 256, .maxDegree = 3, .quadrature = 2};
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
