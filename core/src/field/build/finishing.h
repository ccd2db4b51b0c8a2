#pragma once
// From a grown octree to a field.

#include "field/build/refiner.h"

namespace hpsdf::detail {

/// Makes fields of the octree of a construction: prunes, enriches, lays out, applies continuity, rounds, bounds.
class Finishing {
 public:
  Finishing(const ConstructionSetup& setup, const CellFitter& fitter) : setup_(setup), fitter_(fitter) {}

  /// The field of a tree, which is the state's own or a copy of it. May be called repeatedly.
  FieldData finish(BuildTree&& tree, const ConstructionState& state);

 private:
  void prune(BuildTree& tree, const ConstructionState& state) const;
  void enrich(BuildTree& tree) const;
  FieldMetadata metadata(const ConstructionState& state, const ErrorTotals& totals) const;

  const ConstructionSetup& setup_;
  const CellFitter& fitter_;
  std::uint64_t ownEvaluations_ = 0;  ///< evaluations of Φ for earlier fields, which do not count for later ones
};

}  // namespace hpsdf::detail
