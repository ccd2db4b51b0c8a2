#include "field/build/refiner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "basis/projection.h"
#include "field/cells/probes.h"
#include "field/precision/round_coefficients.h"
#include "field/query/quantized.h"
#include "hpsdf/detail/triangle_search.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {

namespace {

/// Returns the weighted error of a fit by the embedded estimate.
double embeddedError(const Fit& fit) {
  if (!(fit.error.squared > 0)) return 0;
  const double weight = fit.error.weighted / fit.error.squared;
  return weight * basis::topDegreeError(fit.coefficients.data(), fit.degree, fit.error.volume);
}

template <typename ErrorOf>
Gains gainsBy(const Fit& current, const Trial& trial, const ErrorOf& errorOf) {
  const int p = current.degree;
  const double error = errorOf(current);
  Gains gains;
  if (trial.raised)
    gains.degree = (error - 8 * errorOf(*trial.raised)) / (coefficientCount(p + 1) - coefficientCount(p));
  if (trial.children) {
    double worstChild = 0;
    for (const Fit& child : *trial.children) worstChild = std::max(worstChild, errorOf(child));
    gains.octree = (error - 8 * worstChild) / (7 * coefficientCount(p));
  }
  return gains;
}

}  // namespace

Gains gainsOf(const Fit& current, const Trial& trial, Estimator estimator) {
  constexpr double kBlind = 4;  // the embedded estimate sees hardly anything of an error so many times greater
  if (estimator == Estimator::checked && current.error.weighted <= kBlind * embeddedError(current))
    return gainsBy(current, trial, embeddedError);
  return gainsBy(current, trial, [](const Fit& fit) { return fit.error.weighted; });
}

ConstructionSetup makeSetup(const DistanceFunction& distance, const BuildOptions& options, const ByteBudget& budget,
                            double length, const Progress& progress) {
  const ErrorGoal goal = errorGoal(options, length);
  const double asked = options.targetError.byDistance().nearDistance;
  return {.distance = distance,
          .options = options,
          .progress = progress,
          .referenceLength = length,
          .nearDistance = asked > 0 ? asked : 0.01 * length,
          .goal = goal,
          .growthGoal = options.criterion == Criterion::optimal ? goal.times(kGrowth) : goal,
          .budget = budget,
          .exactCells = exactCells(distance, options, length)};
}

std::optional<ExactCells> exactCells(const DistanceFunction& distance, const BuildOptions& options, double length) {
  if (options.strategy != Strategy::hpx || !mayHaveExactLeaves(distance, length)) return std::nullopt;
  return ExactCells(*distance.triangleSearch(), options.exactWithin * length,
                    static_cast<std::size_t>(options.exactTriangles), options.blend);
}

ExactTotals sumOfErrors(const BuildTree& tree) {
  ExactTotals sum;
  for (const BuildNode& node : tree.nodes)
    if (node.firstChild == 0) sum.add(node.fit.error);
  return sum;
}

QuantizationLimits ConstructionSetup::quantizationLimits() const {
  const TriangleSearch* search = distance.triangleSearch();
  return {options, referenceLength, search != nullptr ? search->offset() : 0};
}

std::optional<Refinement> Refiner::allowed(const BuildNode& leaf) const {
  const BuildOptions& options = setup.options;
  if (leaf.fit.isFinal) return std::nullopt;
  const bool mayRaise = isHp(options.strategy) && leaf.fit.degree < options.maxDegree;
  const bool maySplit = int(leaf.depth) < options.maxDepth;
  if (mayRaise && maySplit) return Refinement::either;
  if (mayRaise) return Refinement::degree;
  if (maySplit) return Refinement::octree;
  return std::nullopt;
}

std::optional<Fit> Refiner::smoothFit(const Box& cell) const {
  const double tolerance = setup.options.exactTolerance * setup.referenceLength;
  if (!(tolerance > 0)) return std::nullopt;
  return fitWithin(fitter, cell, tolerance, setup.options.maxDegree, [&] { return setup.exactCells->isSmooth(cell); });
}

Fit Refiner::firstFit(const Box& cell) const {
  std::optional<Fit> exact = setup.exactCells ? setup.exactCells->fitOfFirstCell(cell) : std::nullopt;
  return exact ? std::move(*exact) : fitter.fit(cell, startDegree(setup.options));
}

bool Refiner::raises(const BuildNode& leaf, const Trial& trial) const {
  if (allowed(leaf) == Refinement::octree || !trial.raised) return false;
  if (!trial.children) return true;
  const Gains gains = gainsOf(leaf.fit, trial, setup.options.estimator);
  return *gains.degree > *gains.octree;
}

bool Refiner::mayStep() const {
  return !state.isFull && (!setup.options.maxSteps || state.steps < *setup.options.maxSteps);
}

Trial Refiner::attempt(const BuildNode& leaf, Refinement allowed) const {
  const Box box = state.tree.boxOf(leaf);
  // With a limit of bytes, only the cells near the surface are exact, because the bytes that the triangles of other
  // cells would add are not known before the octree is finished.
  if (setup.exactCells && !setup.options.maxBytes)
    if (std::optional<Fit> exact = setup.exactCells->fitOfRefinedCell(box)) {
      exact->error.near = leaf.fit.error.near;
      return {.raised = {}, .children = {}, .exact = std::move(exact)};
    }
  return fitter.attempt(box, leaf.fit, allowed);
}

void Refiner::makeExact(std::uint32_t leaf, Fit&& fit) {
  Fit& before = state.tree.nodes[leaf].fit;
  state.coefficients += fit.coefficients.size();
  state.coefficients -= setup.budget.finalCoefficients(before);
  const double listed = bytesOf(fit.list);
  state.exactSize.inTree += listed;
  state.exactSize.inField += listed;
  before = std::move(fit);
}

void Refiner::apply(std::uint32_t leaf, Trial&& trial, bool raises) {
  BuildTree& tree = state.tree;
  const StepErrors errors = errorsOf(leaf, trial, raises);
  if (trial.exact) {
    makeExact(leaf, std::move(*trial.exact));
    return countStep(errors);
  }

  // Refuse a refinement that would exceed the limit of bytes.
  const ByteBudget& budget = setup.budget;
  const std::size_t before = budget.finalCoefficients(tree.nodes[leaf].fit.degree);
  const std::size_t added = raises ? budget.finalCoefficients(trial.raised->degree) - before : 7 * before;
  if (!hasRoom(double(tree.nodes.size()) + (raises ? 0 : 8), double(state.coefficients + added))) {
    state.isFull = true;
    return;
  }

  state.coefficients += added;
  if (raises) {
    tree.nodes[leaf].fit = std::move(*trial.raised);
  } else {
    const bool keepsOwnFit = setup.options.criterion == Criterion::optimal;
    tree.split(leaf, std::move(*trial.children), keepsOwnFit ? std::move(*trial.raised) : Fit{});
  }
  countStep(errors);
}

StepErrors Refiner::errorsOf(std::uint32_t leaf, const Trial& trial, bool raises) const {
  StepErrors errors{.before = state.tree.nodes[leaf].fit.error, .after = {}};
  if (trial.exact)
    errors.after.push_back(trial.exact->error);
  else if (raises)
    errors.after.push_back(trial.raised->error);
  else
    for (const Fit& child : *trial.children) errors.after.push_back(child.error);
  return errors;
}

/// Returns the bytes of the quantized coefficients of a field that is made from the present tree; infinity if they
/// cannot be quantized. `rms` is the estimated RMS error.
static double quantizedBytes(const BuildTree& tree, const QuantizationLimits& limits, double rms) {
  QuantizedPart part;
  const auto forEachLeaf = [&](const auto& f) {
    for (const BuildNode& node : tree.nodes)
      if (node.firstChild == 0 && !node.fit.isExact()) f(node);
  };
  forEachLeaf(
      [&](const BuildNode& node) { part.add(tree.boxOf(node).volume(), double(node.fit.coefficients.size())); });
  const double forRms = limits.stepForRms(part, rms);
  double bytes = 0;
  forEachLeaf([&](const BuildNode& node) {
    const Fit& fit = node.fit;
    const double step = std::min(forRms, limits.greatestStep(fit.coefficients, fit.degree));
    bytes +=
        step > 0 ? query::quantizedBytes(fit.coefficients, fit.degree, step) : std::numeric_limits<double>::infinity();
  });
  return bytes;
}

void Refiner::countCoefficientBytes() {
  state.coefficientBytes = setup.budget.coefficientBytes();
  if (!setup.options.maxBytes || !setup.budget.mayQuantize()) return;
  std::size_t coefficients = 0;
  for (const BuildNode& node : state.tree.nodes)
    if (node.firstChild == 0) coefficients += node.fit.coefficients.size();
  if (coefficients == 0) return;
  const double rms = std::sqrt(sumOfErrors(state.tree).rounded().weighted / state.tree.domain.volume());
  const double bytes = quantizedBytes(state.tree, setup.quantizationLimits(), rms) / double(coefficients);
  state.coefficientBytes = std::min(state.coefficientBytes, bytes);
}

bool Refiner::hasRoom(double nodes, double coefficients) {
  const double limit = setup.budget.growthLimit(state.exactSize.inField);
  if (bytesWith(nodes, coefficients) <= limit) return true;
  // Since the bytes were counted, the octree has grown, and its coefficients have become more exact.
  if (!setup.options.maxBytes) return false;
  countCoefficientBytes();
  return bytesWith(nodes, coefficients) <= limit;
}

void Refiner::countStep(const StepErrors& errors) {
  state.totals.add(errors.before, -1);
  for (const CellError& error : errors.after) state.totals.add(error);
  ++state.steps;
  if (observer.afterStep) observer.afterStep(state.steps);
}

void Refiner::countAll() {
  state.totals = sumOfErrors(state.tree);
  if (shares != nullptr) shares->add(state.totals);
  state.coefficients = 0;
  for (const BuildNode& node : state.tree.nodes)
    if (node.firstChild == 0) state.coefficients += setup.budget.finalCoefficients(node.fit);
  state.exactSize = setup.exactSize(state.tree);
}

MemoryNeed Refiner::memoryNeed(double leastFactor, double likelyFactor) const {
  // Estimate the memory. If pruning follows, the projections and the internal nodes that are kept for it need
  // about three times as much memory as the coefficients of the leaves.
  // Exact leaves are in memory twice when the arrays of the field are made. Their bytes count as coefficients.
  const bool keepsAll = setup.options.criterion == Criterion::optimal;
  const double exactBytes = state.exactSize.inTree + state.exactSize.inField;
  return {.nodes = state.tree.nodes.size(),
          .coefficients = (keepsAll ? 4 * state.coefficients : state.coefficients) +
                          static_cast<std::size_t>(exactBytes / sizeof(double)),
          .growthFactor = leastFactor,
          .likelyFactor = likelyFactor,
          .fixedBytes = setup.distance.bytes()};
}

}  // namespace hpsdf::detail
