// Times of the inside test by winding number: by hierarchy, by the sum over all faces, and within a construction.

#include "hpsdf/detail/sign_check.h"
#include "scene.h"
#include "sign/winding_number.h"

namespace hpsdf::bench {
namespace {

void allFaces(benchmark::State& state) {
  const std::vector<Vector3> points = uniformPoints(100);
  timeEach(state, points.size(), [&] {
    for (const Vector3& x : points) benchmark::DoNotOptimize(windingNumber(bunny(), x) > 0.5);
  });
}

void byHierarchy(benchmark::State& state) {
  static const bvh::Hierarchy hierarchy(bunny(), boundingBox(bunny()));
  static const sign::WindingNumber winding(hierarchy);
  const std::vector<Vector3> points = uniformPoints(10'000);
  timeEach(state, points.size(), [&] {
    for (const Vector3& x : points) benchmark::DoNotOptimize(winding.isAbove(x));
  });
}

void construction(benchmark::State& state, InsideTest sign) {
  const BuildOptions options{.targetError = 1e-6};
  for ([[maybe_unused]] auto _ : state)
    benchmark::DoNotOptimize(build(ExactDistance(bunny(), {.insideTest = sign}), paperDomain(), options));
}

BENCHMARK(allFaces)->Name("winding/all_faces");
BENCHMARK(byHierarchy)->Name("winding/ours");
BENCHMARK_CAPTURE(construction, normals, InsideTest::pseudonormal)
    ->Name("winding/build_normals")
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Iterations(1);
BENCHMARK_CAPTURE(construction, winding, InsideTest::winding)
    ->Name("winding/build")
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Iterations(1);
BENCHMARK_CAPTURE(construction, automatic, InsideTest::automatic)
    ->Name("winding/build_auto")
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Iterations(1);

}  // namespace
}  // namespace hpsdf::bench
