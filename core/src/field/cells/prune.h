#pragma once
// Pruning of the octree. It undoes refinements, first those with the greatest saving of bytes per added error.

#include <array>
#include <optional>

#include "field/cells/build_tree.h"
#include "field/nearness.h"
#include "field/precision/round_coefficients.h"

namespace hpsdf::detail {

struct PruneLimits {
  ErrorGoal goal;                        ///< errors that the pruned tree must not exceed
  std::optional<double> mostBytes = {};  ///< limit of bytes, kept even if the error goal is missed
  double nodeBytes = 8;                  ///< bytes of a node
  /// Number of coefficients that a leaf gets, by its degree in the pruned tree.
  std::array<double, kExactDegree + 1> coefficients = {};
  double coefficientBytes = 8;  ///< bytes of a coefficient that is not quantized
  /// Given if coefficients are quantized. Their bytes then depend on the leaf, and on the error of the pruned tree.
  std::optional<QuantizationLimits> quantization = {};
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
