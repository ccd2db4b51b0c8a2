#pragma once
// Pruning of the octree. It undoes refinements, first those with the greatest saving of bytes per added error.

#include <array>
#include <optional>

#include "field/cells/build_tree.h"
#include "field/nearness.h"

namespace hpsdf::detail {

struct PruneLimits {
  ErrorGoal goal;                        ///< errors that the pruned tree must not exceed
  std::optional<double> mostBytes = {};  ///< limit of bytes, kept even if the error goal is missed
  double nodeBytes = 8;                  ///< bytes of an internal node
  /// Bytes of a leaf with its coefficients, by degree. The entry of `kExactDegree` is the bytes of its node alone.
  std::array<double, kExactDegree + 1> leafBytes = {};
  int leastDegree = 1;  ///< least degree of a leaf
  int mostDegree = kMaxDegree;
};

/// Prunes a tree: turns internal nodes into leaves and lowers degrees. The pruned tree minimizes error + λ·bytes, as in
/// classification and source coding (Breiman et al. 1984; Chou, Lookabaugh, Gray 1989). λ is the greatest value that
/// keeps the error goal or, if greater, the least value that keeps the limit of bytes. The error of a node is the
/// residual of its projection at the chosen degree: ∫Φ² minus the projection's squared norm. `Fit::cached` of every
/// node must hold the projection.
void prune(BuildTree& tree, const Nearness& nearness, const PruneLimits& limits);

}  // namespace hpsdf::detail
