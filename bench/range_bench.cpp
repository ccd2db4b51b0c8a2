// Times of certified ranges over random boxes of an eighth of the domain's edge, on one thread.

#include <vector>

#include "hpsdf/continuity.h"
#include "hpsdf/range.h"
#include "scene.h"

namespace hpsdf::bench {
namespace {

constexpr std::size_t kBoxes = 200'000;

/// Returns random boxes in the paper's domain with edges of an eighth of the domain's.
std::vector<Box> randomBoxes() {
  const Vector3 edges = paperDomain().sizes() / 8;
  std::vector<Box> boxes;
  boxes.reserve(kBoxes);
  for (const Vector3& x : uniformPoints(kBoxes)) {
    const Vector3 lower = paperDomain().min() + (x - paperDomain().min()) * 7 / 8;
    boxes.emplace_back(lower, Vector3(lower + edges));
  }
  return boxes;
}

void ranges(benchmark::State& state, const Field& field) {
  const std::vector<Box> boxes = randomBoxes();
  const RangeIndex index(field, 1);
  std::vector<FieldRange> out(kBoxes);
  timeEach(state, kBoxes, [&] {
    for (std::size_t i = 0; i < kBoxes; ++i) out[i] = index.range(boxes[i]);
  });
  state.counters["bytes"] = double(index.bytes());
}

void bunnyRanges(benchmark::State& state) { ranges(state, bunnyField()); }
void blendedRanges(benchmark::State& state) {
  static const Field field = blended(bunnyField());
  ranges(state, field);
}
void preparedRanges(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(RangeIndex(bunnyField(), 1));
}

BENCHMARK(bunnyRanges)->Name("range/bunny");
BENCHMARK(blendedRanges)->Name("range/blended");
BENCHMARK(preparedRanges)->Name("range/index")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace hpsdf::bench
