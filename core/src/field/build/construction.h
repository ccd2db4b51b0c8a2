#pragma once
// One construction of a field by Algorithm 1: its stages, one after the other.

#include <cstdint>
#include <functional>

#include "field/build/checkpoint_file.h"
#include "field/build/limits.h"
#include "field/build/refiner.h"
#include "field/cells/build_tree.h"
#include "field/cells/cell_fit.h"
#include "field/kept/kept_leaves.h"
#include "hpsdf/build_options.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/field.h"

namespace hpsdf::detail {

/// Returns the settings with the strategy that takes effect. Throws `Error` if exact leaves were asked for and would
/// not fit into memory, long before they would fill it.
BuildOptions settled(BuildOptions options, const DistanceFunction& distance, const Box& domain,
                     const Progress& progress);

/// One construction of a field. It runs the stages of the paper's Algorithm 1 one after the other.
class Construction {
 public:
  /// Keeps references to the arguments. If `kept` is given, the construction begins with these leaves of an earlier
  /// field, which are neither fitted nor refined; leaves that cannot be kept after all are taken out of it. Cells of
  /// that field all of whose leaves are to be built anew begin as one leaf. The new cells may have the part of the
  /// target error that the kept leaves do not use, and a small part in any case. L is that of the earlier field.
  Construction(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
               const Progress& progress, KeptLeaves* kept = nullptr);

  /// From now on, saves the state of the construction to a file. If the file already holds a state, continues
  /// from that state and returns true.
  bool resume(CheckpointFile& file);

  /// From now on, shares the construction with other processes. Call it before `resume`, which only rank 0 may call.
  void shareWith(Shares& shares);

  /// From now on, offers the field of the present state after each round of refinements (`OfferField`).
  void offerTo(const std::function<void(const std::function<Field()>& fieldSoFar)>& offer);

  std::uint64_t steps() const { return state_.steps; }

  /// Refines the octree until an error or a limit ends it. `afterStep` may be empty (`GrowthObserver`). If several
  /// processes build the field, each has a part of its octree afterwards, or rank 0 has all of it (`finishesByParts`).
  void grow(const std::function<void(std::uint64_t)>& afterStep = {});

  /// Returns false if another process finishes the field alone, which has the whole octree.
  bool goesOn() const { return goesOn_; }

  /// Returns the field of the present state. It is made from a copy of the state's tree.
  Field snapshot() { return Field(finish(BuildTree(state_.tree))); }
  FieldData finish() { return finish(std::move(state_.tree)); }

 private:
  void beginWithKept();
  /// Gives all processes the state of rank 0, and each of them a part of the octree.
  void spread();
  /// Takes the whole octree to rank 0.
  void gather();
  /// Refines the octree together with the other processes. After that rank 0 has all of it.
  void growByRanks();
  /// Saves the state if that is due. If several processes build the field, all of them call this when it is due, and
  /// only rank 0 has a file.
  void saveState();
  /// Returns true if each process can lay out and round its part of the field, so that no process needs all cells.
  bool finishesByParts() const;
  void endSharing();
  /// Makes a field from the state's tree or a copy of it. If other processes hold parts of the octree, rank 0 alone
  /// gets a field, and the others one without nodes. Prunes the tree, raises its degrees, lays it out in arrays,
  /// applies continuity, rounds the coefficients and computes bounds, as far as the options ask for it.
  FieldData finish(BuildTree&& tree);
  /// Returns the field of the present state, as it would be if no stages followed the refinement.
  Field fieldSoFar() const;
  /// Returns the bytes that the limit leaves for the coefficients of a field.
  double mostCoefficientBytes(const FieldData& field) const;
  /// Returns true if twice the octree would not exceed the allowed memory.
  bool hasMemoryForAnother() const { return hasMemory(refiner_.memoryNeed(2), setup_.options); }
  void prune(BuildTree& tree) const;
  /// Fits every leaf of the tree anew, one degree higher. All coefficients of a leaf then come from samples in
  /// this leaf.
  void enrich(BuildTree& tree) const;
  FieldMetadata metadata(const ErrorTotals& totals) const;

  ConstructionState state_;
  ByteBudget budget_;
  ConstructionSetup setup_;
  CellFitter fitter_;
  GrowthObserver observer_{.afterStep = {}, .atWholeState = [] {}};
  Refiner refiner_;
  std::uint64_t ownEvaluations_ = 0;  ///< evaluations of the exact distance by earlier calls of `finish`
  bool goesOn_ = true;
  CheckpointFile* file_ = nullptr;  ///< keeps the state; only on rank 0 if several processes build the field
  KeptLeaves* kept_;                ///< the leaves of an earlier field with which the construction began
  double keptError_ = 0;            ///< estimate of the weighted error of these leaves
};

}  // namespace hpsdf::detail
