// Contours of the bunny: how large the mesh is at which distance from the bunny, and how long it takes from a field in
// memory.

#include "contour_scene.h"

namespace hpsdf::bench {
namespace {

void contourOfBunny(benchmark::State& state, bool simplify) {
  const Field& field = contourField();
  ContourOptions options = kContourOptions;
  options.simplify = simplify;
  Contour made;
  for ([[maybe_unused]] auto _ : state) made = contour(field, options);
  countMesh(state, made.mesh);
  state.counters["missed"] = double(made.unresolved + made.flawed);
}

BENCHMARK_CAPTURE(contourOfBunny, ours, false)
    ->Name("contour/ours")
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Iterations(1);
BENCHMARK_CAPTURE(contourOfBunny, simplified, true)
    ->Name("contour/simplified")
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Iterations(1);

}  // namespace
}  // namespace hpsdf::bench
