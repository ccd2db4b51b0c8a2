#pragma once
// Pruning of the octree. It undoes refinements, first those that save the most bytes for the error that undoing
// them adds.

#include <array>
#include <optional>

#include "field/cells/build_tree.h"
#include "field/nearness.h"

namespace hpsdf::detail {

struct PruneLimits {
  ErrorGoal goal;                                     ///< goal that pruning must not miss
  std::optional<double> mostBytes = {};               ///< limit that is kept even if the goal is missed
  double nodeBytes = 8;                               ///< bytes of an internal node
  std::array<double, kMaxDegree + 1> leafBytes = {};  ///< bytes of a leaf with its coefficients, by degree
  int leastDegree = 1;                                ///< least degree of a leaf
  int mostDegree = kMaxDegree;
};

/// Prunes a tree: turns internal nodes into leaves and lowers degrees. Of all possible results it takes the one
/// with the least error + λ·bytes, as the pruning of trees in classification and source coding does (Breiman et
/// al. 1984; Chou, Lookabaugh, Gray 1989). λ is the greatest that keeps the goal. The error of a node at a
/// degree is the residual ∫Φ² − Σc² of its samples, so that every node needs its `Fit::cached`.
void prune(BuildTree& tree, const Nearness& nearness, const PruneLimits& limits);

}  // namespace hpsdf::detail
