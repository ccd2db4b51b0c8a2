#pragma once
// Pruning: refinements are taken back that save most bytes for the error they cost.

#include <array>
#include <optional>

#include "field/cells/build_tree.h"
#include "field/nearness.h"

namespace hpsdf::detail {

struct PruneLimits {
  ErrorGoal goal;                                     ///< it stays reached
  std::optional<double> mostBytes = {};               ///< kept even where the goal is not
  double nodeBytes = 8;                               ///< bytes of an internal node
  std::array<double, kMaxDegree + 1> leafBytes = {};  ///< bytes of a leaf with its coefficients, by degree
  int leastDegree = 1;                                ///< least degree of a leaf
  int mostDegree = kMaxDegree;
};

/// Turns internal nodes into leaves and lowers degrees. Among all trees that result it takes the one of least
/// error + λ · bytes, as trees are pruned in classification and source coding (Breiman et al. 1984; Chou, Lookabaugh,
/// Gray 1989), with the greatest λ that keeps the goal. The error of a node at a degree is the residual ∫Φ² − Σc² of
/// its samples, so that every node needs its `Fit::cached`.
void prune(BuildTree& tree, const Nearness& nearness, const PruneLimits& limits);

}  // namespace hpsdf::detail
