#pragma once
// Taking refinements back where they save most for the error that they leave.

#include <array>
#include <optional>

#include "field/build/build_tree.h"
#include "field/nearness.h"

namespace hpsdf {

struct PruneLimits {
  ErrorGoal goal;                                     ///< not to be left
  std::optional<double> mostBytes = {};               ///< to be kept, even where the goal is not
  double nodeBytes = 8;                               ///< of an internal node
  std::array<double, kMaxDegree + 1> leafBytes = {};  ///< of a leaf with its coefficients, by degree
  int leastDegree = 1;                                ///< of a leaf
  int mostDegree = kMaxDegree;
};

/// Cuts branches off and lowers degrees. Of all trees to be had so it takes the one of least error + λ · bytes, as
/// trees are pruned in classification and source coding (Breiman et al. 1984; Chou, Lookabaugh, Gray 1989), by the
/// greatest λ that keeps the goal. The error of a node at a degree is what its samples leave, ∫Φ² − Σc², so that every
/// node needs its `Fit::spare`.
void prune(BuildTree& tree, const Nearness& nearness, const PruneLimits& limits);

}  // namespace hpsdf
