#pragma once
// The state of a construction, the refinement of single leaves, and the two stages that grow the octree.

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "field/build/limits.h"
#include "field/cells/build_tree.h"
#include "field/cells/exact_leaves.h"
#include "field/precision/round_coefficients.h"
#include "field/shares/shares.h"

namespace hpsdf::detail {

/// The state of a construction: all that must be kept so that another process can continue it.
struct ConstructionState {
  /// The stage of a construction that runs next. All earlier stages are done.
  enum class Stage : std::uint8_t { fitFirstCells, refine, probe };

  Stage stage = Stage::fitFirstCells;
  std::uint64_t fittedCells = 0;  ///< number of nodes, in their order, whose first fits are done
  std::uint64_t steps = 0;        ///< refinements so far: leaves whose degree was raised, or that were split
  Nearness nearness;
  ExactTotals totals;           ///< sums of errors over all leaves, updated with each step; derived, not stored
  double measuredError = 0;     ///< greatest error among the leaves that the max-error pass has finished
  bool isFull = false;          ///< true once a refinement would have exceeded the limit of bytes
  std::uint64_t processed = 0;  ///< number of entries of `pending` that the max-error pass has finished
  BuildTree tree;
  std::vector<std::uint32_t> deferred;  ///< leaves set aside while the near or the far error meets its goal
  std::vector<std::uint32_t> pending;   ///< leaves whose maximum error is measured, in this order
  double coefficientBytes = 0;          ///< bytes of a coefficient in the finished field, on average
  std::size_t coefficients = 0;         ///< number of coefficients of the finished field; derived, not stored
  ExactSize exactSize;                  ///< memory of the exact leaves; derived, not stored
};

/// The goal of a construction, and the settings and objects that all stages share.
struct ConstructionSetup {
  const DistanceFunction& distance;
  const BuildOptions& options;
  const Progress& progress;
  double referenceLength;  ///< length L by which the target error is scaled
  double nearDistance;     ///< distance up to which an error counts as near the surface
  ErrorGoal goal;
  ErrorGoal growthGoal;  ///< goal before pruning: a smaller error than `goal` if pruning follows
  const ByteBudget& budget;
  std::optional<ExactCells> exactCells = {};  ///< makes exact leaves; only for `Strategy::hpx`

  /// Returns by how much quantizing may change the polynomials of this construction.
  QuantizationLimits quantizationLimits() const;
  /// Returns the memory of the exact leaves of a tree of this construction.
  ExactSize exactSize(const BuildTree& tree) const {
    return detail::exactSize(tree, distance.triangleSearch(), budget.coefficientType());
  }
};

/// Returns the setup of a construction in which the surface has the size `referenceLength`. It keeps references to the
/// other arguments.
ConstructionSetup makeSetup(const DistanceFunction& distance, const BuildOptions& options, const ByteBudget& budget,
                            double referenceLength, const Progress& progress);

/// Returns what makes exact leaves for these options; std::nullopt if they ask for none, or if there can be none.
std::optional<ExactCells> exactCells(const DistanceFunction& distance, const BuildOptions& options,
                                     double referenceLength);

/// Callbacks during the refinement of the octree.
struct GrowthObserver {
  /// Called with the number of refinement steps: with 0 once the base cells are fitted, then after each step. May
  /// be empty.
  std::function<void(std::uint64_t steps)> afterStep;
  /// Called whenever the state of the construction is complete, so that it can be saved. If several processes build
  /// the field, all of them call it, after rounds before which `isDue` returned true on rank 0.
  std::function<void()> atWholeState;
  /// Tells whether the state should be saved; may be empty. Called only if several processes build the field.
  std::function<bool()> isDue = {};
};

/// The errors of a leaf, and of the leaf or the leaves that a refinement puts in its place.
struct StepErrors {
  CellError before;
  std::vector<CellError> after;
};

/// Applies refinements to the octree of a construction's state. Keeps the error totals of the state up to date.
struct Refiner {
  const ConstructionSetup& setup;
  const CellFitter& fitter;
  ConstructionState& state;
  const GrowthObserver& observer;
  Shares* shares = nullptr;       ///< the other processes that build the field; nullptr if there are none
  std::uint64_t aheadOfTurn = 0;  ///< evaluations for trials of leaves whose turn has not come

  /// Returns the refinements of a leaf that the limits of degree and depth allow, or std::nullopt if they allow
  /// none.
  std::optional<Refinement> allowed(const BuildNode& leaf) const;
  /// Returns false once the limit of refinement steps or of bytes is reached.
  bool mayStep() const;

  /// Returns a polynomial that stands for the triangles near a cell, if there is one.
  std::optional<Fit> smoothFit(const Box& cell) const;
  /// Returns the first fit of a cell that exact leaves near the surface have left without one.
  Fit firstFit(const Box& cell) const;

  /// Decides between a higher degree and a split (paper, eqs. 7 to 9), with errors weighted by nearness to the surface.
  /// Returns true if a higher degree reduces the error more per additional coefficient. If only one refinement was
  /// tried, or is allowed, the decision is for that one.
  bool raises(const BuildNode& leaf, const Trial& trial) const;

  /// Computes the fit without error of a leaf or, if there is none, the fits of its allowed refinements. Thread-safe.
  Trial attempt(const BuildNode& leaf, Refinement allowed) const;

  /// Makes a leaf exact if `trial` has a fit without error. Otherwise raises the degree of the leaf if `raises` is
  /// true, else splits the leaf. The new fits come from `trial`. If the limit of bytes forbids the refinement, sets
  /// `isFull` of the state instead.
  void apply(std::uint32_t leaf, Trial&& trial, bool raises);

  /// Returns the errors before and after a refinement by a trial.
  StepErrors errorsOf(std::uint32_t leaf, const Trial& trial, bool raises) const;
  /// Counts a refinement, which this process or another one has applied, and updates the error totals.
  void countStep(const StepErrors& errors);
  /// Sums the errors of all leaves of all processes, and counts what this process holds.
  void countAll();
  /// Replaces the fit of a leaf by a fit without error.
  void makeExact(std::uint32_t leaf, Fit&& fit);
  /// Returns the size in bytes of the field that would be made from the present octree.
  double bytes() const { return bytesWith(double(state.tree.nodes.size()), double(state.coefficients)); }
  double bytesWith(double nodes, double coefficients) const {
    return setup.budget.nodeBytes() * nodes + state.coefficientBytes * coefficients + state.exactSize.inField;
  }
  /// Counts the bytes of a coefficient, which change with the octree if the coefficients are quantized.
  void countCoefficientBytes();
  /// Returns true if the limit of bytes allows a field with so many nodes and coefficients.
  bool hasRoom(double nodes, double coefficients);
  /// Returns the memory that the octree needs if it grows by `leastFactor` at least and probably by `likelyFactor`.
  MemoryNeed memoryNeed(double leastFactor = 1, double likelyFactor = 1) const;
  /// Throws `Error` if the octree exceeds the allowed memory now, or will exceed it after growing by these factors.
  void requireMemory(double leastFactor = 1, double likelyFactor = 1) const {
    detail::requireMemory(memoryNeed(leastFactor, likelyFactor), setup.options);
  }
};

/// The weighted error that a refinement removes per additional coefficient; empty for one that was not tried.
struct Gains {
  std::optional<double> degree, octree;
};

/// Returns the gains of a trial (μ and ν; paper, eqs. 7 to 9). For `Estimator::checked`, the errors are those of the
/// embedded estimate where that sees the error of the current fit.
Gains gainsOf(const Fit& current, const Trial& trial, Estimator estimator);

ExactTotals sumOfErrors(const BuildTree& tree);

/// Fits the base cells, then refines the leaves with the greatest errors until the goal is reached (paper,
/// Algorithm 1). Continues with the next step if the state was restored. Ends early if the limit of steps or
/// bytes is reached.
void growByErrors(Refiner& refiner);

/// The result of the pass for a maximum error in a leaf: the leaf's greatest error and, if that error is too great,
/// the fits of its possible refinements.
struct Probed {
  double worst = 0;  ///< greatest error, from `worstError`
  std::optional<Trial> trial;
  bool raises = false;  ///< the choice between the refinements of `trial`
};

/// Measures the error of a leaf at probe points and, if it exceeds `BuildOptions::maxError`, chooses a refinement.
Probed probe(const Refiner& refiner, const BuildNode& leaf);

/// Measures the error of every leaf at probe points, and refines the leaf while its greatest error exceeds
/// `BuildOptions::maxError`. If a limit ends this early, the state stores the greatest error that remains.
void refineByProbes(Refiner& refiner);

}  // namespace hpsdf::detail
