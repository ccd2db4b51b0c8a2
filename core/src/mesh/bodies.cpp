#include "mesh/bodies.h"

#include <algorithm>
#include <utility>

namespace hpsdf {
namespace {

/// A patch at an edge, and how many more of its sides rise there than fall.
using Excess = std::pair<std::uint32_t, int>;

/// Of an edge: those patches whose own sides do not balance there.
void findExcess(const Patches& patches, std::span<const Side> edge, std::vector<Excess>& found) {
  found.clear();
  for (const Side& side : edge) found.emplace_back(patches.of[side.face], side.rising ? 1 : -1);
  std::ranges::sort(found);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < found.size();) {
    Excess sum{found[i].first, 0};
    for (; i < found.size() && found[i].first == sum.first; ++i) sum.second += found[i].second;
    if (sum.second != 0) found[kept++] = sum;
  }
  found.resize(kept);
}

}  // namespace

Bodies bodiesOf(const Patches& patches, std::span<const Side> sides) {
  FaceSets together(patches.count);
  std::vector<char> open = patches.oneSided;
  std::vector<Excess> excess;
  forEachEdge(sides, [&](std::span<const Side> edge) {
    findExcess(patches, edge, excess);
    int all = 0;
    for (const auto& [patch, sum] : excess) {
      together.join(excess.front().first, patch);
      all += sum;
    }
    if (all != 0) open[excess.front().first] = 1;
  });
  const auto count = static_cast<std::uint32_t>(patches.count);
  for (std::uint32_t patch = 0; patch < count; ++patch)
    if (open[patch]) open[together.first(patch)] = 1;
  Bodies bodies;
  for (std::uint32_t patch = 0; patch < count; ++patch) {
    const std::uint32_t body = together.first(patch);
    bodies.closed.push_back(!open[body]);
    bodies.of.push_back(open[body] ? patch : body);
  }
  return bodies;
}

}  // namespace hpsdf
