// Times of a field's queries at a million random points in random order, on one thread.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <variant>
#include <vector>

#include "hpsdf/continuity.h"
#include "scene.h"

namespace hpsdf::bench {
namespace {

constexpr std::size_t kPoints = 1'000'000;

void values(benchmark::State& state, const Field& field) {
  const std::vector<Vector3> points = uniformPoints(kPoints);
  std::vector<double> out(kPoints);
  timeEach(state, kPoints, [&] {
    for (std::size_t i = 0; i < kPoints; ++i) out[i] = field.value(points[i]);
  });
}

void gradients(benchmark::State& state, const Field& field) {
  const std::vector<Vector3> points = uniformPoints(kPoints);
  std::vector<ValueAndGradient> out(kPoints);
  timeEach(state, kPoints, [&] {
    for (std::size_t i = 0; i < kPoints; ++i) out[i] = field.valueAndGradient(points[i]);
  });
}

void hessians(benchmark::State& state, const Field& field) {
  const std::vector<Vector3> points = uniformPoints(kPoints);
  std::vector<ValueGradientHessian> out(kPoints);
  timeEach(state, kPoints, [&] { field.valuesGradientsHessians(points, out); });
}

void batched(benchmark::State& state, const Field& field) {
  const std::vector<Vector3> points = uniformPoints(kPoints);
  std::vector<double> out(kPoints);
  timeEach(state, kPoints, [&] { field.values(points, out); });
}

void batchedGradients(benchmark::State& state, const Field& field) {
  const std::vector<Vector3> points = uniformPoints(kPoints);
  std::vector<ValueAndGradient> out(kPoints);
  timeEach(state, kPoints, [&] { field.valuesAndGradients(points, out); });
}

/// The data that queries of a field read for some points: for each point the entry of the lookup grid and the nodes on
/// the way down, each of which tells where the next one is, and the cache lines of the coefficients.
class Reads {
 public:
  Reads(const Field& field, const std::vector<Vector3>& points) {
    for (const Vector3& x : points) add(field, x);
  }

  /// Reads all of it and computes nothing. The reads of a point depend on each other as those of a query do.
  std::uint64_t read() const {
    const std::uint64_t none = none_;  // 0, but not for the compiler
    std::uint64_t sum = 0;
    for (const Read& read : reads_) {
      std::uint64_t offset = 0;
      for (const std::uint64_t* node : read.nodes) offset = *(node + offset) & none;
      for (const char* line : read.lines) sum += std::uint64_t(*(line + offset));
    }
    return sum;
  }

 private:
  /// Points that need fewer reads repeat the last one.
  struct Read {
    std::array<const std::uint64_t*, 4> nodes;
    std::array<const char*, 3> lines;
  };

  void add(const Field& field, const Vector3& x) {
    const LookupGrid& grid = field.lookupGrid();
    std::array<std::int64_t, 3> fixed;
    for (int axis = 0; axis < 3; ++axis) {
      const double coordinate = (x[axis] - grid.frame.lower[axis]) / grid.frame.size[axis] * grid.frame.cells[axis];
      fixed[axis] = std::min(std::int64_t(std::ldexp(coordinate, kMaxDepth)), grid.frame.last[axis]);
    }
    const auto digitsTo = [&](int axis, int depth) { return fixed[axis] >> (kMaxDepth - depth); };
    Read read;
    const std::uint64_t* node = &grid.entries[std::size_t(
        digitsTo(2, grid.depth) * grid.slab + digitsTo(1, grid.depth) * grid.row + digitsTo(0, grid.depth))];
    std::size_t count = 0;
    for (int depth = LookupGrid::depthOf(*node); count < read.nodes.size(); ++count) {
      read.nodes[count] = node;
      if (node::isLeaf(*node)) continue;
      ++depth;
      std::uint32_t child = 0;
      for (int axis = 0; axis < 3; ++axis) child |= std::uint32_t(digitsTo(axis, depth) & 1) << axis;
      node = &field.data().nodes[node::firstChild(*node) + child];
    }
    setLines(field, *node, read);
    reads_.push_back(read);
  }

  /// Sets the cache lines of a leaf's coefficients.
  static void setLines(const Field& field, std::uint64_t leaf, Read& read) {
    const auto [first, bytes] = std::visit(
        [&](const auto& c) -> std::pair<const char*, std::size_t> {
          if constexpr (requires { c.bytes; })
            return {reinterpret_cast<const char*>(c.bytes.at(node::offset(leaf), 1)), 1};
          else
            return {reinterpret_cast<const char*>(c.at(node::offset(leaf), 1)),
                    coefficientCount(node::degree(leaf)) * sizeof(*c.data())};
        },
        field.data().coefficients);
    for (std::size_t n = 0; n < read.lines.size(); ++n) read.lines[n] = first + std::min(64 * n, bytes - 1);
  }

  std::vector<Read> reads_;
  volatile std::uint64_t none_ = 0;
};

/// Measures the time of the reads of queries alone.
void reads(benchmark::State& state, const Field& field) {
  const Reads reads(field, uniformPoints(kPoints));
  timeEach(state, kPoints, [&] { benchmark::DoNotOptimize(reads.read()); });
}

/// Returns the bunny's field, blended with the default width of the blend zones.
const Field& blendedBunny() {
  static const Field field = blended(bunnyField());
  return field;
}

void bunnyValue(benchmark::State& state) { values(state, bunnyField()); }
void bunnyGradient(benchmark::State& state) { gradients(state, bunnyField()); }
void bunnyHessian(benchmark::State& state) { hessians(state, bunnyField()); }
void bunnyBatched(benchmark::State& state) { batched(state, bunnyField()); }
void bunnyBatchedGradient(benchmark::State& state) { batchedGradients(state, bunnyField()); }
void bunnyReads(benchmark::State& state) { reads(state, bunnyField()); }
void floatValue(benchmark::State& state) { values(state, floatBunnyField()); }
void floatGradient(benchmark::State& state) { gradients(state, floatBunnyField()); }
void floatHessian(benchmark::State& state) { hessians(state, floatBunnyField()); }
void floatBatched(benchmark::State& state) { batched(state, floatBunnyField()); }
void floatBatchedGradient(benchmark::State& state) { batchedGradients(state, floatBunnyField()); }
void floatReads(benchmark::State& state) { reads(state, floatBunnyField()); }
void blendedValue(benchmark::State& state) { values(state, blendedBunny()); }
void blendedGradient(benchmark::State& state) { gradients(state, blendedBunny()); }
void blendedHessian(benchmark::State& state) { hessians(state, blendedBunny()); }
void blendedBatched(benchmark::State& state) { batched(state, blendedBunny()); }
void blendedBatchedGradient(benchmark::State& state) { batchedGradients(state, blendedBunny()); }
void armadilloValue(benchmark::State& state) { values(state, armadilloField()); }
void armadilloGradient(benchmark::State& state) { gradients(state, armadilloField()); }

BENCHMARK(bunnyValue)->Name("query/bunny/value");
BENCHMARK(bunnyGradient)->Name("query/bunny/gradient");
BENCHMARK(bunnyHessian)->Name("query/bunny/hessian");
BENCHMARK(bunnyBatched)->Name("query/bunny/batched");
BENCHMARK(bunnyBatchedGradient)->Name("query/bunny/batched_gradient");
BENCHMARK(bunnyReads)->Name("query/bunny/reads");
BENCHMARK(floatValue)->Name("query/float/value");
BENCHMARK(floatGradient)->Name("query/float/gradient");
BENCHMARK(floatHessian)->Name("query/float/hessian");
BENCHMARK(floatBatched)->Name("query/float/batched");
BENCHMARK(floatBatchedGradient)->Name("query/float/batched_gradient");
BENCHMARK(floatReads)->Name("query/float/reads");
BENCHMARK(blendedValue)->Name("query/blended/value");
BENCHMARK(blendedGradient)->Name("query/blended/gradient");
BENCHMARK(blendedHessian)->Name("query/blended/hessian");
BENCHMARK(blendedBatched)->Name("query/blended/batched");
BENCHMARK(blendedBatchedGradient)->Name("query/blended/batched_gradient");
BENCHMARK(armadilloValue)->Name("query/armadillo/value");
BENCHMARK(armadilloGradient)->Name("query/armadillo/gradient");

}  // namespace
}  // namespace hpsdf::bench
