#pragma once
// Poses of two bodies side by side, at which contacts are compared with those of other libraries.

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <vector>

#include "scene.h"

namespace hpsdf::bench {

const TriangleMesh& armadillo();

/// World poses of the bunny and the armadillo.
struct Places {
  Eigen::Isometry3d bunny, armadillo;
};

enum class Nearness {
  touching,  ///< 1 to 99 samples of either body lie inside the other body, as in a pile
  apart,     ///< each body has samples within 0.1 of the other one, but none within 0.03 (more than the sample spacing)
};

/// Number of random poses for each kind of nearness.
constexpr std::size_t kPlaces = 100;
const std::vector<Places>& places(Nearness nearness);

/// The contacts of the bunny and the armadillo at one pair of poses.
struct Touch {
  std::size_t contacts = 0;
  double deepest = 0;
};

/// Times `find`, which takes `Places` and returns a `Touch`, over all pairs of poses. Reports the mean number of
/// contacts, the deepest contact and the number of pairs of poses that have contacts.
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
