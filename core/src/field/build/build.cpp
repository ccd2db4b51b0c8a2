#include "hpsdf/build.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "field/build/automatic_strategy.h"
#include "field/build/checkpoint_file.h"
#include "field/build/refiner.h"
#include "field/build/tolerance_build.h"
#include "field/cells/cell_bounds.h"
#include "field/cells/prune.h"
#include "field/continuity/continuity.h"
#include "field/precision/round_coefficients.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace {

using namespace detail;

/// Estimates the octree of the exact leaves, as far as it has no more than `mostNodes` nodes.
ExactEstimate exactEstimate(const DistanceFunction& distance, const BuildOptions& options, const Box& domain,
                            double mostNodes, const Progress& progress) {
  const std::optional<ExactCells> cells = exactCells(distance, domain, options);
  if (!cells) return {};
  BuildTree baseCells{.domain = domain, .grid = options.grid, .nodes = {}};
  baseCells.addBaseCells();
  return estimateExactLeaves(std::move(baseCells), *cells, options.maxDepth, mostNodes, progress);
}

/// Returns the settings with the strategy that takes effect. Throws `Error` if exact leaves were asked for and would
/// not fit into memory, long before they would fill it.
BuildOptions settled(BuildOptions options, const DistanceFunction& distance, const Box& domain,
                     const Progress& progress) {
  const bool isFree = options.strategy == Strategy::automatic;
  if (isFree)
    options.strategy =
        automaticStrategy(distance.triangleSearch(), options, referenceLength(distance.source(), domain));
  if (options.strategy != Strategy::hpx) return options;
  if (!exactCells(distance, domain, options)) {
    options.strategy = Strategy::hp;
    return options;
  }
  if (isFree) {
    const ExactEstimate estimate = exactEstimate(distance, options, domain, kMostNodesOfAutomatic, progress);
    if (estimate.nodes > kMostNodesOfAutomatic) options.strategy = Strategy::hp;
  } else if (options.exactTolerance == 0) {  // polynomials in place of lists would be unknown to the estimate
    // The estimate goes on to what the machine allows, so that an error can name the memory that suffices.
    requireMemoryForExact(exactEstimate(distance, options, domain, mostNodes({}), progress), distance.bytes(), options);
  }
  return options;
}

/// Throws `Error` if the options ask for a tolerance, which goes without the steps of Algorithm 1.
void refuseTolerance(const BuildOptions& options, const char* what) {
  if (options.tolerance > 0)
    throw Error(std::string("a construction within a tolerance has no steps, and so no ") + what + ": leave out the " +
                what + " or the tolerance");
}

/// One construction of a field. It runs the stages of the paper's Algorithm 1 one after the other.
class Construction {
 public:
  Construction(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
               const Progress& progress)
      : budget_(options),
        setup_(makeSetup(distance, domain, options, budget_, progress)),
        fitter_(distance, options, state_.nearness, setup_.nearDistance, progress),
        refiner_{setup_, fitter_, state_, observer_} {
    state_.nearness = nearnessOf(options, domain);
    state_.tree.domain = domain;
    state_.tree.grid = options.grid;
    refiner_.requireMemory();  // checks the memory of the exact distance before anything is built
  }

  /// From now on, saves the state of the construction to a file. If the file already holds a state, continues
  /// from that state and returns true.
  bool resume(CheckpointFile& file) {
    observer_.atWholeState = [this, &file] {
      if (!file.isDue()) return;
      file.keep([this](detail::CheckedWriter& writer) { save(writer, state_, fitter_.evaluations()); });
    };
    std::optional<detail::CheckedReader> reader = file.open();
    if (reader) fitter_.setEvaluations(restore(*reader, state_, setup_));
    return reader.has_value();
  }

  /// From now on, offers the field of the present state after each round of refinements.
  void offerTo(const OfferField& offer) {
    if (!offer) return;
    observer_.atWholeState = [this, &offer] {
      if (state_.stage != ConstructionState::Stage::fitFirstCells && hasMemoryForAnother())
        offer([this] { return fieldSoFar(); });
    };
  }

  std::uint64_t steps() const { return state_.steps; }

  void grow(const std::function<void(std::uint64_t)>& afterStep = {}) {
    observer_.afterStep = afterStep;
    growByErrors(refiner_);
    if (setup_.options.maxError > 0) refineByProbes(refiner_);
  }

  /// Returns the field of the present state. It is made from a copy of the state's tree.
  Field snapshot() { return Field(finish(BuildTree(state_.tree))); }
  FieldData finish() { return finish(std::move(state_.tree)); }

 private:
  /// Makes a field from the state's tree or a copy of it. Prunes the tree, raises its degrees, lays it out in
  /// arrays, applies continuity, rounds the coefficients and computes bounds, as far as the options ask for it.
  FieldData finish(BuildTree&& tree) {
    const BuildOptions& options = setup_.options;
    const std::uint64_t before = fitter_.evaluations();

    // Prune the tree and raise its degrees. The cells are then final.
    if (options.criterion == Criterion::optimal) prune(tree);
    if (options.enrich) enrich(tree);
    FieldMetadata built = metadata(sumOfErrors(tree));
    FieldData field = layOut(std::move(tree), std::move(built), setup_.distance.triangleSearch());

    // Reduce the jumps between cells in double precision, then round the coefficients. The coefficients are then final.
    if (options.continuityWeight)
      continuity::makeWeaklyContinuous(field, {.weight = *options.continuityWeight}, setup_.progress);
    field.blend = options.blend;
    roundCoefficients(budget_.coefficientType(), field, mostCoefficientBytes(field));

    // Compute the error bounds, which hold for the rounded coefficients and include blending.
    if (options.bounds) field.metadata.exactEvaluations += findBounds(field, setup_.distance, setup_.progress);
    ownEvaluations_ += fitter_.evaluations() - before;
    return field;
  }

  /// Returns the field of the present state, as it would be if no stages followed the refinement.
  Field fieldSoFar() const {
    FieldData field = layOut(state_.tree, metadata(sumOfErrors(state_.tree)), setup_.distance.triangleSearch());
    field.blend = setup_.options.blend;
    roundCoefficients(CoefficientType::float32, field);
    return Field(std::move(field));
  }

  /// Returns the bytes that the limit leaves for the coefficients of a field.
  double mostCoefficientBytes(const FieldData& field) const {
    return budget_.limit() - state_.exactSize.inField - budget_.nodeBytes() * double(field.nodes.size());
  }

  /// Returns true if twice the octree would not exceed the allowed memory.
  bool hasMemoryForAnother() const { return detail::hasMemory(refiner_.memoryNeed(2), setup_.options); }

  void prune(BuildTree& tree) const {
    const BuildOptions& options = setup_.options;
    PruneLimits limits{.goal = setup_.goal, .nodeBytes = budget_.nodeBytes()};
    for (int degree = 0; degree <= kMaxDegree; ++degree)
      limits.coefficients[degree] = double(budget_.finalCoefficients(degree));
    limits.coefficientBytes = budget_.coefficientBytes();
    if (budget_.mayQuantize()) limits.quantization = setup_.quantizationLimits();
    // If the refinement missed its goal for another reason than the limit of bytes, relax the goal of pruning, so
    // that pruning can still undo refinements.
    if (!setup_.growthGoal.reached(state_.totals) && !state_.isFull)
      limits.goal = setup_.goal.relaxedTo(state_.totals, 1 / kGrowth);
    if (options.maxBytes) limits.mostBytes = budget_.limit() - state_.exactSize.inField;
    limits.leastDegree = leastDegree(options);
    limits.mostDegree = mostDegree(options);
    detail::prune(tree, state_.nearness, limits);
  }

  /// Fits every leaf of the tree anew, one degree higher. All coefficients of a leaf then come from samples in
  /// this leaf.
  void enrich(BuildTree& tree) const {
    constexpr std::size_t kChunk = 4096;
    std::size_t coefficients = 0;
    for (const BuildNode& node : tree.nodes)
      if (node.firstChild == 0) coefficients += budget_.finalCoefficients(node.fit);
    requireMemory({.nodes = tree.nodes.size(), .coefficients = coefficients, .fixedBytes = setup_.distance.bytes()},
                  setup_.options);
    for (std::size_t begin = 0; begin < tree.nodes.size(); begin += kChunk) {
      setup_.progress.update("raising every degree", double(begin) / double(tree.nodes.size()));
      tbb::parallel_for(begin, std::min(begin + kChunk, tree.nodes.size()), [&](std::size_t n) {
        BuildNode& node = tree.nodes[n];
        const int degree = budget_.finalDegree(node.fit.degree);
        if (node.firstChild != 0 || node.fit.isFinal || node.fit.degree >= degree) return;
        node.fit = fitter_.fit(tree.boxOf(node), degree);
        node.fit.cached = {};
      });
    }
  }

  FieldMetadata metadata(const ErrorTotals& totals) const {
    const double scale = std::pow(setup_.referenceLength / 2, 5);
    FieldMetadata metadata;
    metadata.source = setup_.distance.source();
    metadata.settings = storedSettings(setup_.options);
    if (setup_.goal.byDistance()) metadata.settings.targetError = totals.weighted / scale;
    metadata.settings.nearness = state_.nearness.exponent;
    metadata.settings.nearnessKind = state_.nearness.kind;
    metadata.settings.maxDegree =
        isHp(setup_.options.strategy) ? setup_.options.maxDegree : budget_.finalDegree(startDegree(setup_.options));
    metadata.totalError = totals.weighted / scale;
    metadata.referenceLength = setup_.referenceLength;
    metadata.measuredError = state_.measuredError;
    metadata.exactEvaluations = fitter_.evaluations() - ownEvaluations_;
    metadata.steps = state_.steps;
    return metadata;
  }

  ConstructionState state_;
  ByteBudget budget_;
  ConstructionSetup setup_;
  CellFitter fitter_;
  GrowthObserver observer_{.afterStep = {}, .atWholeState = [] {}};
  Refiner refiner_;
  std::uint64_t ownEvaluations_ = 0;  ///< evaluations of the exact distance by earlier calls of `finish`
};

}  // namespace

void checkBuild(const Box& domain, const BuildOptions& options) { checkOptions(domain, options); }

Field build(const DistanceFunction& distance, const Box& domain, const BuildOptions& options, const Progress& progress,
            const OfferField& offer) {
  checkOptions(domain, options);
  return Field(withThreads(options.threads, [&] {
    if (options.tolerance > 0) return buildWithinTolerance(distance, domain, options, progress);
    const BuildOptions settings = settled(options, distance, domain, progress);
    Construction construction(distance, domain, settings, progress);
    construction.offerTo(offer);
    construction.grow();
    return construction.finish();
  }));
}

Field buildResumably(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                     const Checkpoint& checkpoint, const Progress& progress) {
  checkOptions(domain, options);
  refuseTolerance(options, "checkpoint");
  return Field(withThreads(options.threads, [&] {
    const BuildOptions settings = settled(options, distance, domain, progress);
    CheckpointFile file(checkpoint, distance, domain, settings);
    Construction construction(distance, domain, settings, progress);
    if (construction.resume(file) && checkpoint.resumed) checkpoint.resumed(construction.steps());
    construction.grow();
    return construction.finish();
  }));
}

void buildStages(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                 std::span<const std::uint64_t> steps, const std::function<void(Field)>& visit,
                 const Progress& progress) {
  if (!std::ranges::is_sorted(steps)) throw Error("stages of a construction: expected steps that do not descend");
  if (steps.empty()) return;
  BuildOptions limited = options;
  limited.maxSteps = std::min(options.maxSteps.value_or(steps.back()), steps.back());
  checkOptions(domain, limited);
  refuseTolerance(options, "stages");
  withThreads(options.threads, [&] {
    limited.strategy = settled(options, distance, domain, progress).strategy;
    Construction construction(distance, domain, limited, progress);
    std::size_t stage = 0;
    const auto visitNext = [&] {
      visit(construction.snapshot());
      ++stage;
    };
    construction.grow([&](std::uint64_t taken) {
      while (stage < steps.size() && steps[stage] == taken) visitNext();
    });
    while (stage < steps.size()) visitNext();  // the construction ended before the remaining stages
  });
}

}  // namespace hpsdf
