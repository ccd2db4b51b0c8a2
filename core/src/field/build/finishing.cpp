#include "field/build/finishing.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "field/build/limits.h"
#include "field/cells/cell_bounds.h"
#include "field/cells/prune.h"
#include "field/continuity/weak_continuity.h"
#include "hpsdf/detail/build_settings.h"

namespace hpsdf::detail {

FieldData Finishing::finish(BuildTree&& tree, const ConstructionState& state) {
  const BuildOptions& options = setup_.options;
  const std::uint64_t before = fitter_.evaluations();

  // Make the cells final.
  if (options.criterion == Criterion::optimal) prune(tree, state);
  if (options.enrich) enrich(tree);
  FieldMetadata built = metadata(state, sumOfErrors(tree));
  FieldData field = layOut(std::move(tree), std::move(built));

  // Make the coefficients final: jumps are reduced in double precision.
  if (options.continuityWeight)
    continuity::makeWeaklyContinuous(field, {.weight = *options.continuityWeight}, setup_.progress);
  roundCoefficients(setup_.budget.coefficientType(), field);
  field.blend = options.blend;

  // Bound the final coefficients as they are blended.
  if (options.bounds) field.metadata.exactEvaluations += findBounds(field, setup_.distance, setup_.progress);
  ownEvaluations_ += fitter_.evaluations() - before;
  return field;
}

void Finishing::prune(BuildTree& tree, const ConstructionState& state) const {
  const BuildOptions& options = setup_.options;
  PruneLimits limits{.goal = setup_.goal, .nodeBytes = setup_.budget.nodeBytes()};
  for (int degree = 0; degree <= kMaxDegree; ++degree) limits.leafBytes[degree] = setup_.budget.leafBytes(degree);
  // A growth that ended early, but not by bytes, has refinements to take back all the same.
  if (!setup_.growthGoal.reached(state.totals) && !state.isFull)
    limits.goal = setup_.goal.relaxedTo(state.totals, 1 / kGrowth);
  if (ByteBudget::isAskedFor(options)) limits.mostBytes = setup_.budget.limit();
  limits.leastDegree = leastDegree(options);
  limits.mostDegree = mostDegree(options);
  detail::prune(tree, state.nearness, limits);
}

/// Fits every leaf anew, one degree higher, so that all of its coefficients come from samples of its own.
void Finishing::enrich(BuildTree& tree) const {
  constexpr std::size_t kChunk = 4096;
  std::size_t coefficients = 0;
  for (const BuildNode& node : tree.nodes)
    if (node.firstChild == 0) coefficients += setup_.budget.finalCoefficients(node.fit.degree);
  requireMemory({.nodes = tree.nodes.size(), .coefficients = coefficients, .fixedBytes = setup_.distance.bytes()},
                setup_.options);
  for (std::size_t begin = 0; begin < tree.nodes.size(); begin += kChunk) {
    setup_.progress.update("raising every degree", double(begin) / double(tree.nodes.size()));
    tbb::parallel_for(begin, std::min(begin + kChunk, tree.nodes.size()), [&](std::size_t n) {
      BuildNode& node = tree.nodes[n];
      const int degree = setup_.budget.finalDegree(node.fit.degree);
      if (node.firstChild != 0 || node.fit.degree >= degree) return;
      node.fit = fitter_.fit(tree.boxOf(node), degree);
      node.fit.cached = {};
    });
  }
}

FieldMetadata Finishing::metadata(const ConstructionState& state, const ErrorTotals& totals) const {
  const double scale = std::pow(setup_.referenceLength / 2, 5);
  FieldMetadata metadata;
  metadata.source = setup_.distance.source();
  metadata.settings = storedSettings(setup_.options);
  if (setup_.goal.byDistance()) metadata.settings.targetError = totals.weighted / scale;
  state.nearness.storeIn(metadata.settings);
  metadata.settings.maxDegree = setup_.options.strategy == Strategy::hp
                                    ? setup_.options.maxDegree
                                    : setup_.budget.finalDegree(startDegree(setup_.options));
  metadata.totalError = totals.weighted / scale;
  metadata.referenceLength = setup_.referenceLength;
  metadata.measuredError = state.measuredError;
  metadata.exactEvaluations = fitter_.evaluations() - ownEvaluations_;
  metadata.steps = state.steps;
  return metadata;
}

}  // namespace hpsdf::detail
