#pragma once
// Two bodies side by side, whose contacts are compared with those of other libraries.

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <vector>

#include "scene.h"

namespace hpsdf::bench {

const TriangleMesh& armadillo();

/// Where the bunny and the armadillo are, in the world.
struct Places {
  Eigen::Isometry3d bunny, armadillo;
};

enum class Nearness {
  touching,  ///< 1 to 99 samples of both lie in the other body, as in a pile
  apart,     ///< none is less than 0.03 away from it, farther than samples are from each other, some less than 0.1
};

/// So many, by chance.
constexpr std::size_t kPlaces = 100;
const std::vector<Places>& places(Nearness nearness);

/// What was found in one place.
struct Touch {
  std::size_t contacts = 0;
  double deepest = 0;
};

/// Times `find`, which takes `Places` and returns a `Touch`, over all places. Reports contacts a place, the deepest of
/// all and the number of places that had any.
template <typename Find>
void timeContacts(benchmark::State& state, Nearness nearness, Find find) {
  const std::vector<Places>& all = places(nearness);
  timeEach(state, all.size(), [&] {
    for (const Places& where : all) benchmark::DoNotOptimize(find(where).contacts);
  });
  std::size_t contacts = 0, touching = 0;
  double deepest = 0;
  for (const Places& where : all) {
    const Touch touch = find(where);
    contacts += touch.contacts;
    deepest = std::max(deepest, touch.deepest);
    if (touch.contacts > 0) ++touching;
  }
  state.counters["contacts"] = double(contacts) / double(all.size());
  state.counters["deepest"] = deepest;
  state.counters["touching"] = double(touching);
}

}  // namespace hpsdf::bench
