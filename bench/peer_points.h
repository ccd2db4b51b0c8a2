#pragma once
// The points at which exact distances are compared with those of other libraries.

#include "scene.h"

namespace hpsdf::bench {

/// Points of the bunny's construction at τ = 1e-5 in their order, about 300,000 in whole batches from all of it.
struct ConstructionPoints {
  std::vector<Vector3> points;
  std::vector<std::size_t> batches;  ///< sizes: these many points were asked for at once
};
const ConstructionPoints& constructionPoints();

constexpr std::size_t kUniformPoints = 5'000;

}  // namespace hpsdf::bench
