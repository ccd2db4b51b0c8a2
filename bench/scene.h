#pragma once
// What the benchmarks share: meshes in [-1, 1]³, the paper's domain, points, and fields that are built once a process.

#include <benchmark/benchmark.h>

#include <cstddef>
#include <random>
#include <string>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field.h"

namespace hpsdf::bench {

/// A mesh of the folder HPSDF_MESHES, e.g. "paper/bunny_69k.obj", normalised. Throws `Error` where it is not there.
TriangleMesh testMesh(const std::string& name);

const TriangleMesh& bunny();
const ExactDistance& bunnyDistance();

/// At τ = 1e-6, the other options by default.
const Field& bunnyField();
const Field& armadilloField();

Box paperDomain();  ///< [-1.1, 1.1]³

/// Uniform in the domain, in random order.
std::vector<Vector3> uniformPoints(std::size_t count);

/// Within `reach` of the bunny's surface, uniform in area and in height above it.
std::vector<Vector3> nearPoints(std::size_t count, double reach);

/// RMS of `values` less the exact distances at `points`.
double rmsError(const std::vector<Vector3>& points, const std::vector<double>& values);

/// Runs `pass`, which does `count` things, and reports the CPU seconds of one of them by this thread, as a counter.
template <typename Pass>
void timeEach(benchmark::State& state, std::size_t count, Pass pass) {
  for ([[maybe_unused]] auto _ : state) {
    pass();
    benchmark::ClobberMemory();
  }
  using benchmark::Counter;
  state.counters["seconds"] = Counter(double(count), Counter::kIsIterationInvariantRate | Counter::kInvert);
}

}  // namespace hpsdf::bench
