#pragma once
// Inputs that the benchmarks share: meshes in [-1, 1]³, the paper's domain, points, and fields built once per process.

#include <benchmark/benchmark.h>

#include <cstddef>
#include <random>
#include <string>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field.h"

namespace hpsdf::bench {

/// Returns a normalized mesh from the folder HPSDF_MESHES, e.g. "paper/bunny_69k.obj". Throws `Error` if it is missing.
TriangleMesh testMesh(const std::string& name);

const TriangleMesh& bunny();
const ExactDistance& bunnyDistance();

/// Returns the bunny's field for the target error τ = 1e-6, with default options otherwise.
const Field& bunnyField();
const Field& armadilloField();

/// Returns the same with float coefficients instead of quantized ones.
const Field& floatBunnyField();

Box paperDomain();  ///< [-1.1, 1.1]³

/// Returns random points, uniformly distributed in the domain.
std::vector<Vector3> uniformPoints(std::size_t count);

/// Returns points within `reach` of the bunny's surface, uniformly distributed in surface area and in height.
std::vector<Vector3> nearPoints(std::size_t count, double reach);

/// Returns the RMS difference between `values` and the exact distances to the bunny at `points`.
double rmsError(const std::vector<Vector3>& points, const std::vector<double>& values);

/// Runs `pass`, which processes `count` items, and reports this thread's CPU seconds per item as a counter.
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
