// Benchmarks of whole constructions from a mesh in memory: the BVH of its triangles and the field.

#include <string>

#include "scene.h"

namespace hpsdf::bench {
namespace {

void construct(benchmark::State& state, const TriangleMesh& mesh, const BuildOptions& options) {
  for ([[maybe_unused]] auto _ : state) {
    const Field field = build(ExactDistance(mesh), paperDomain(), options);
    state.counters["cells"] = double(statistics(field).leaves);
  }
}

BuildOptions bunnyOptions(int threads) {
  return {.targetError = 1e-6, .coefficients = CoefficientType::float64, .threads = threads};
}

void bunnyByTwo(benchmark::State& state) { construct(state, bunny(), bunnyOptions(2)); }
void bunnyByOne(benchmark::State& state) { construct(state, bunny(), bunnyOptions(1)); }

void largeBunny(benchmark::State& state) {
  static const TriangleMesh mesh = testMesh("large/bunny_1114k_loop2.ply");
  construct(state, mesh, bunnyOptions(2));
}

void armadillo(benchmark::State& state) {
  static const TriangleMesh mesh = testMesh("paper/armadillo_100k.obj");
  construct(state, mesh, {.targetError = 1e-6, .threads = 2});
}

void dragon(benchmark::State& state) {
  static const TriangleMesh mesh = testMesh("paper/dragon_80k.obj");
  construct(state, mesh, {.targetError = 1e-7, .grid = {10, 10, 10}, .threads = 2});
}

void addBenchmark(const char* name, void (*run)(benchmark::State&)) {
  benchmark::RegisterBenchmark(name, run)->MeasureProcessCPUTime()->UseRealTime()->Iterations(1)->Unit(
      benchmark::kSecond);
}

[[maybe_unused]] const bool added = [] {
  addBenchmark("build/bunny/two_threads", bunnyByTwo);
  addBenchmark("build/bunny/one_thread", bunnyByOne);
  addBenchmark("build/bunny/large", largeBunny);
  addBenchmark("build/armadillo", armadillo);
  addBenchmark("build/dragon", dragon);
  return true;
}();

}  // namespace
}  // namespace hpsdf::bench
