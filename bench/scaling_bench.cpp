// Growth of a construction's cost with a smaller target error, and with a finer mesh of the same surface.

#include <cmath>
#include <map>
#include <utility>

#include "scene.h"

namespace hpsdf::bench {
namespace {

/// Splits each triangle into four coplanar triangles at the midpoints of its edges.
TriangleMesh subdivided(const TriangleMesh& mesh) {
  TriangleMesh fine;
  fine.vertices = mesh.vertices;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [at, isNew] = middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(fine.vertices.size()));
    if (isNew) fine.vertices.emplace_back((mesh.vertices[a] + mesh.vertices[b]) / 2);
    return at->second;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    fine.triangles.insert(fine.triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return fine;
}

void construct(benchmark::State& state, const TriangleMesh& mesh, double target) {
  for ([[maybe_unused]] auto _ : state) {
    const Field field = build(ExactDistance(mesh), paperDomain(), {.targetError = target});
    state.counters["target"] = target;
    state.counters["faces"] = double(mesh.triangles.size());
    state.counters["cells"] = double(statistics(field).leaves);
    state.counters["distances"] = double(field.metadata().exactEvaluations);
  }
}

void byTarget(benchmark::State& state) { construct(state, bunny(), std::pow(10, -double(state.range(0)))); }

void byFaces(benchmark::State& state) {
  TriangleMesh mesh = bunny();
  for (int i = 0; i < state.range(0); ++i) mesh = subdivided(mesh);
  construct(state, mesh, 1e-6);
}

void once(benchmark::internal::Benchmark* benchmark) {
  benchmark->MeasureProcessCPUTime()->UseRealTime()->Iterations(1)->Unit(benchmark::kSecond);
}

BENCHMARK(byTarget)->Name("scaling/target")->DenseRange(3, 7)->Apply(once);
BENCHMARK(byFaces)->Name("scaling/faces")->DenseRange(0, 2)->Apply(once);

}  // namespace
}  // namespace hpsdf::bench
