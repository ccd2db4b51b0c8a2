#pragma once
// Points at which exact distances are computed by this library and by others, for comparison.

#include "scene.h"

namespace hpsdf::bench {

/// The points of one call of the distance function.
struct Batch {
  std::size_t size;
  bool withGradients;
};

/// About 300,000 points at which the bunny's construction at τ = 1e-6 asks for distances: whole batches, in order.
struct ConstructionPoints {
  std::vector<Vector3> points;
  std::vector<Batch> batches;
};
const ConstructionPoints& constructionPoints();

constexpr std::size_t kUniformPoints = 5'000;

}  // namespace hpsdf::bench
