#include "field/build/construction.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "field/build/automatic_strategy.h"
#include "field/cells/cell_bounds.h"
#include "field/cells/exact_leaves.h"
#include "field/cells/prune.h"
#include "field/continuity/continuity.h"
#include "field/precision/round_coefficients.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {
namespace {

using Stage = ConstructionState::Stage;

/// Estimates the octree of the exact leaves, as far as it has no more than `mostNodes` nodes.
ExactEstimate exactEstimate(const DistanceFunction& distance, const BuildOptions& options, const Box& domain,
                            double mostNodes, const Progress& progress) {
  const std::optional<ExactCells> cells = exactCells(distance, options, referenceLength(distance.source(), domain));
  if (!cells) return {};
  BuildTree baseCells{.domain = domain, .grid = options.grid, .nodes = {}};
  baseCells.addBaseCells();
  return estimateExactLeaves(std::move(baseCells), *cells, options.maxDepth, mostNodes, progress);
}

}  // namespace

BuildOptions settled(BuildOptions options, const DistanceFunction& distance, const Box& domain,
                     const Progress& progress) {
  const bool isFree = options.strategy == Strategy::automatic;
  if (isFree)
    options.strategy =
        automaticStrategy(distance.triangleSearch(), options, referenceLength(distance.source(), domain));
  if (options.strategy != Strategy::hpx) return options;
  if (!exactCells(distance, options, referenceLength(distance.source(), domain))) {
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

Construction::Construction(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                           const Progress& progress, KeptLeaves* kept)
    : budget_(options),
      setup_(makeSetup(
          distance, options, budget_,
          kept != nullptr ? kept->before->metadata.referenceLength : referenceLength(distance.source(), domain),
          progress)),
      fitter_(distance, options, state_.nearness, setup_.nearDistance, progress),
      refiner_{setup_, fitter_, state_, observer_},
      kept_(kept) {
  state_.nearness = nearnessOf(options, domain);
  state_.tree.domain = domain;
  state_.tree.grid = options.grid;
  refiner_.requireMemory();  // checks the memory of the exact distance before anything is built
  if (kept != nullptr) beginWithKept();
}

bool Construction::resume(CheckpointFile& file) {
  file_ = &file;
  observer_.isDue = [&file] { return file.isDue(); };
  observer_.atWholeState = [this] { saveState(); };
  std::optional<CheckedReader> reader = file.open();
  if (!reader) return false;
  fitter_.setEvaluations(restore(*reader, state_, setup_));
  if (state_.stage != Stage::fitFirstCells && refiner_.shares == nullptr) refiner_.countAll();
  return true;
}

void Construction::saveState() {
  if (refiner_.shares == nullptr) {
    if (file_ != nullptr && file_->isDue())
      file_->keep([this](CheckedWriter& writer) { save(writer, state_, fitter_.evaluations()); });
    return;
  }
  ConstructionState whole = state_;
  refiner_.shares->gatherAtFirst({whole.tree, whole.deferred});
  const std::uint64_t evaluations = refiner_.shares->sum(fitter_.evaluations() - refiner_.aheadOfTurn);
  whole.fittedCells = whole.tree.nodes.size();
  if (file_ != nullptr) file_->keep([&](CheckedWriter& writer) { save(writer, whole, evaluations); });
}

void Construction::shareWith(Shares& shares) {
  refiner_.shares = &shares;
  observer_.atWholeState = [this] { saveState(); };
}

void Construction::spread() {
  Shares& shares = *refiner_.shares;
  if (!shares.isFirst() || state_.stage == Stage::fitFirstCells) {
    // A state in which not all first cells are fitted holds little, and is begun anew.
    state_.tree.nodes.clear();
    state_.tree.addBaseCells();
    state_.fittedCells = 0;
    fitter_.setEvaluations(0);
  }
  MessageWriter message;
  write(message, state_, fitter_.evaluations());
  const Message first = shares.fromFirst(message.take());
  if (!shares.isFirst()) {
    read(first, state_);
    for (BuildNode& node : state_.tree.nodes) node.fit = fitElsewhere();
  }
  if (state_.stage == Stage::probe) return;
  const auto one = [](const BuildNode& node) { return node.fit.isFinal ? 0 : 1; };
  shares.divide({state_.tree, state_.deferred}, setup_.options.maxDepth, one, shares.weights(state_.tree, one));
  if (state_.stage == Stage::refine) refiner_.countAll();
}

void Construction::gather() {
  Shares& shares = *refiner_.shares;
  fitter_.setEvaluations(shares.sum(fitter_.evaluations()));
  shares.gatherAtFirst({state_.tree, state_.deferred});
}

void Construction::growByRanks() {
  spread();
  if (state_.stage != Stage::probe) {
    growByErrors(refiner_);
    if (finishesByParts()) return;
    gather();
  }
  goesOn_ = refiner_.shares->isFirst();
  endSharing();
  refiner_.countAll();
}

bool Construction::finishesByParts() const {
  const BuildOptions& options = setup_.options;
  return options.strategy != Strategy::hpx && options.criterion != Criterion::optimal && !options.continuityWeight &&
         !(options.maxError > 0);
}

void Construction::endSharing() {
  refiner_.shares->close();
  refiner_.shares = nullptr;  // rank 0 goes on alone
}

void Construction::offerTo(const std::function<void(const std::function<Field()>&)>& offer) {
  if (!offer) return;
  observer_.atWholeState = [this, &offer] {
    if (state_.stage != Stage::fitFirstCells && hasMemoryForAnother()) offer([this] { return fieldSoFar(); });
  };
}

void Construction::beginWithKept() {
  constexpr std::size_t kMostTriangles = std::size_t{1} << 20;  // of a list, which was not too long before
  constexpr double kLeastShare = 0.02;  // of the target error, so that it can be reached where Φ was smooth before
  const auto exactFit = [&](const Box& cell) {
    return setup_.exactCells ? setup_.exactCells->fitOfFarCell(cell, kMostTriangles) : std::nullopt;
  };
  makeTree(*kept_, exactFit, state_.tree, setup_.progress);
  const FieldMetadata& before = kept_->before->metadata;
  const double errorBefore = before.totalError * std::pow(before.referenceLength / 2, 5);
  keptError_ = kept_->keptError * errorBefore;
  double& goal = setup_.goal.weighted;
  if (kept_->kept > 0) goal = std::max(goal, errorBefore);
  goal = std::max(goal - keptError_, kLeastShare * goal);
  setup_.growthGoal = setup_.options.criterion == Criterion::optimal ? setup_.goal.times(kGrowth) : setup_.goal;
}

void Construction::grow(const std::function<void(std::uint64_t)>& afterStep) {
  observer_.afterStep = afterStep;
  refiner_.shares == nullptr ? growByErrors(refiner_) : growByRanks();
  if (goesOn_ && setup_.options.maxError > 0) refineByProbes(refiner_);
}

FieldData Construction::finish(BuildTree&& tree) {
  const BuildOptions& options = setup_.options;
  const std::uint64_t before = fitter_.evaluations();

  // Prune the tree and raise its degrees. The cells are then final.
  if (options.criterion == Criterion::optimal) prune(tree);
  if (options.enrich) enrich(tree);
  Shares* shares = refiner_.shares;
  ExactTotals totals = sumOfErrors(tree);
  if (shares != nullptr) {
    shares->add(totals);
    fitter_.setEvaluations(shares->sum(fitter_.evaluations()));
  }
  FieldMetadata built = metadata(totals.rounded());
  FieldData field = layOut(std::move(tree), std::move(built), setup_.distance.triangleSearch());

  // Reduce the jumps between cells in double precision, then round the coefficients. The coefficients are then final.
  if (options.continuityWeight)
    continuity::makeWeaklyContinuous(field, {.weight = *options.continuityWeight}, setup_.progress);
  field.blend = options.blend;
  roundCoefficients(budget_.coefficientType(), field, mostCoefficientBytes(field),
                    kept_ != nullptr ? keptSteps(*kept_, field) : KeptSteps{},
                    shares != nullptr ? shares->across() : AcrossParts{});
  if (shares != nullptr) {
    field = shares->gatheredAtFirst(std::move(field));
    endSharing();
    if (field.nodes.empty()) return field;  // rank 0 has it
  }
  if (kept_ != nullptr)  // kept coefficients were rounded before
    field.metadata.roundingRms = std::hypot(
        field.metadata.roundingRms, std::sqrt(std::max(0.0, kept_->keptVolume)) * kept_->before->metadata.roundingRms);

  // Compute the error bounds, which hold for the rounded coefficients and include blending.
  if (options.bounds) field.metadata.exactEvaluations += findBounds(field, setup_.distance, setup_.progress);
  ownEvaluations_ += fitter_.evaluations() - before;
  return field;
}

Field Construction::fieldSoFar() const {
  FieldData field = layOut(state_.tree, metadata(sumOfErrors(state_.tree).rounded()), setup_.distance.triangleSearch());
  field.blend = setup_.options.blend;
  roundCoefficients(CoefficientType::float32, field);
  return Field(std::move(field));
}

double Construction::mostCoefficientBytes(const FieldData& field) const {
  return budget_.limit() - state_.exactSize.inField - budget_.nodeBytes() * double(field.nodes.size());
}

void Construction::prune(BuildTree& tree) const {
  const BuildOptions& options = setup_.options;
  PruneLimits limits{.goal = setup_.goal, .nodeBytes = budget_.nodeBytes()};
  for (int degree = 0; degree <= kMaxDegree; ++degree)
    limits.coefficients[degree] = double(budget_.finalCoefficients(degree));
  limits.coefficientBytes = budget_.coefficientBytes();
  if (budget_.mayQuantize()) limits.quantization = setup_.quantizationLimits();
  // If the refinement missed its goal for another reason than the limit of bytes, relax the goal of pruning, so
  // that pruning can still undo refinements.
  if (!setup_.growthGoal.reached(state_.totals.rounded()) && !state_.isFull)
    limits.goal = setup_.goal.relaxedTo(state_.totals.rounded(), 1 / kGrowth);
  if (options.maxBytes) limits.mostBytes = budget_.limit() - state_.exactSize.inField;
  limits.leastDegree = leastDegree(options);
  limits.mostDegree = mostDegree(options);
  detail::prune(tree, state_.nearness, limits);
}

void Construction::enrich(BuildTree& tree) const {
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

FieldMetadata Construction::metadata(const ErrorTotals& totals) const {
  const double scale = std::pow(setup_.referenceLength / 2, 5);
  FieldMetadata metadata;
  metadata.source = setup_.distance.source();
  metadata.settings = storedSettings(setup_.options);
  if (setup_.goal.byDistance()) metadata.settings.targetError = totals.weighted / scale;
  metadata.settings.nearness = state_.nearness.exponent;
  metadata.settings.nearnessKind = state_.nearness.kind;
  metadata.settings.maxDegree =
      isHp(setup_.options.strategy) ? setup_.options.maxDegree : budget_.finalDegree(startDegree(setup_.options));
  metadata.totalError = (totals.weighted + keptError_) / scale;
  metadata.referenceLength = setup_.referenceLength;
  metadata.measuredError = state_.measuredError;
  if (kept_ != nullptr && kept_->kept > 0)
    metadata.measuredError = std::max(metadata.measuredError, kept_->before->metadata.measuredError);
  metadata.exactEvaluations = fitter_.evaluations() - ownEvaluations_;
  metadata.steps = state_.steps;
  return metadata;
}

}  // namespace hpsdf::detail
