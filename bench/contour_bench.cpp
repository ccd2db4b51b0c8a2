// Contours of the bunny: how large the mesh is at which distance from the bunny, and how long it takes from a field in
// memory.

#include "contour_scene.h"

namespace hpsdf::bench {
namespace {

void contourOfBunny(benchmark::State& state) {
  const Field& field = contourField();
  Contour made;
  for ([[maybe_unused]] auto _ : state) made = contour(field, kContourOptions);
  countMesh(state, made.mesh);
  state.counters["missed"] = double(made.unresolved + made.flawed);
}

BENCHMARK(contourOfBunny)->Name("contour/ours")->MeasureProcessCPUTime()->UseRealTime()->Iterations(1);

}  // namespace
}  // namespace hpsdf::bench
