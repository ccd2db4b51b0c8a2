#include "hpsdf/cell_history.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <variant>

#include "basis/orthonormal.h"
#include "basis/projection.h"
#include "field/build/least_bytes.h"
#include "field/build/refiner.h"
#include "field/build/tolerance_build.h"
#include "field/cells/exact_lists.h"
#include "field/query/leaves.h"
#include "field/tolerance/tolerance_fit.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/random_points.h"
#include "hpsdf/detail/triangle_list.h"

namespace hpsdf {
namespace {

using namespace detail;

/// Errors of polynomials of one cell at random points.
class CellMeasure {
 public:
  CellMeasure(const DistanceFunction& distance, const Box& cell, const Progress& progress) {
    constexpr std::size_t kPoints = 1000;
    constexpr std::uint64_t kSeed = 31;
    for (std::size_t i = 0; i < kPoints; ++i)
      local_.push_back(Random(kSeed, i).inBox(Box(-Vector3::Ones(), Vector3::Ones())));
    exact_ = sampleCell(distance, cell, local_, progress);
  }

  void rate(const Fit& fit, CellStep& step) const {
    double sum = 0, worst = 0;
    for (std::size_t i = 0; i < local_.size(); ++i) {
      const double error = std::abs(fit.valueAt(local_[i]) - exact_[i]);
      sum += error * error;
      worst = std::max(worst, error);
    }
    step.measuredRms = std::sqrt(sum / double(local_.size()));
    step.measuredMax = worst;
  }

 private:
  std::vector<Vector3> local_;
  std::vector<double> exact_;
};

/// The place of the field's leaf, and the way to it.
class Target {
 public:
  Target(const Field& field, const Vector3& x) : field_(field), cell_(field.cellAt(x)) {
    query::visitNodes(field.data(), [&](const query::OctreeNode& node) {
      if (node.node == cell_.id)
        for (int axis = 0; axis < 3; ++axis) index_[axis] = static_cast<std::uint32_t>(node.cellIndex[axis]);
      return true;
    });
  }

  const Cell& cell() const { return cell_; }
  bool isExact() const { return cell_.degree == kExactDegree; }

  /// Returns the cell of a depth, up to that of the leaf, which holds the leaf.
  CellPlace at(int depth) const {
    CellPlace place{static_cast<std::uint32_t>(depth), index_};
    for (std::uint32_t& index : place.index) index >>= cell_.depth - depth;
    return place;
  }
  /// Returns the number of the child at depth `depth` + 1 that holds the leaf.
  std::uint32_t childBelow(int depth) const {
    const CellPlace child = at(depth + 1);
    return (child.index[0] & 1) | (child.index[1] & 1) << 1 | (child.index[2] & 1) << 2;
  }
  /// Returns the node of the field at this place.
  std::uint32_t nodeAt(const CellPlace& place) const {
    return query::nodeAt(field_.data(), {place.index[0], place.index[1], place.index[2]}, int(place.depth)).node;
  }

  /// Returns true if a fit is the leaf of the field up to the rounding of coefficients.
  bool holds(const Fit& fit) const {
    const FieldData& data = field_.data();
    const std::uint64_t bits = data.nodes[cell_.id];
    if (fit.isExact() != node::isExact(bits)) return false;
    if (fit.isExact()) return TriangleListView(data.exact, bits).count() == fit.list.triangles.size();
    if (fit.degree != node::degree(bits)) return false;
    constexpr double kRounding = 8 * std::numeric_limits<float>::epsilon();
    const auto* quantized = std::get_if<QuantizedCoefficients>(&data.coefficients);
    const double halfStep = quantized ? quantized->stepOf(bits) / 2 : 0;
    return withCoefficients(data, bits, [&](const auto* stored) {
      double scale = 0, difference = 0;  // beyond that by quantizing
      basis::forEachCoefficient(fit.degree, [&](int i, int j, int k, int index) {
        const double found = std::abs(double(stored[index]) - fit.coefficients[index]);
        scale = std::max(scale, std::abs(double(stored[index])));
        difference = std::max(difference, found - halfStep * basis::norm(i, j, k));
      });
      return difference <= kRounding * scale;
    });
  }

 private:
  const Field& field_;
  Cell cell_;
  std::array<std::uint32_t, 3> index_{};
};

/// Returns the bytes of a coefficient of a field that has polynomials, on average.
double averageCoefficientBytes(const FieldData& field) {
  double count = 0;
  for (const std::uint64_t node : field.nodes)
    if (node::isLeaf(node) && !node::isExact(node)) count += coefficientCount(node::degree(node));
  return double(coefficientBytes(field)) / std::max(count, 1.0);
}

/// Repeats Algorithm 1 for one leaf.
class RefinementReplay {
 public:
  RefinementReplay(const Field& field, const BuildOptions& options, const DistanceFunction& distance,
                   const Target& target, const Progress& progress)
      : distance_(distance),
        target_(target),
        progress_(progress),
        options_(options),
        budget_(options_),
        setup_(makeSetup(distance, options_, budget_, field.metadata().referenceLength, progress)),
        fitter_(distance, options_, state_.nearness, setup_.nearDistance, progress),
        refiner_{setup_, fitter_, state_, observer_},
        scale_(std::pow(setup_.referenceLength / 2, 5)),
        averageCoefficientBytes_(averageCoefficientBytes(field.data())) {
    state_.nearness = nearnessOf(options_, field.domain());
    state_.tree.domain = field.domain();
    state_.tree.grid = field.grid();
  }

  CellHistory run() {
    history_.cell = target_.cell();
    BuildNode node = nodeAt(0, {});
    if (!placeExactLeaf(node)) return std::move(history_);
    if (!node.fit.isFinal) {
      node.fit = refiner_.firstFit(boxOf(node));
      node = refine(std::move(node));
    } else {
      keep(node, CellStage::exactLeaves);
    }
    finish(node);
    return std::move(history_);
  }

 private:
  /// A cell on the way to the leaf, and the trial that decided about it.
  struct Visited {
    BuildNode node;
    std::optional<Trial> trial = {};
    bool raises = false;
    CellStage stage = CellStage::refinement;
  };

  BuildNode nodeAt(int depth, Fit fit) const {
    const CellPlace place = target_.at(depth);
    return {.depth = place.depth, .cellIndex = place.index, .fit = std::move(fit)};
  }
  Box boxOf(const BuildNode& node) const { return state_.tree.boxOf(node); }

  /// Repeats the placing of exact leaves. Returns false if the field has a leaf where the replay divides a cell.
  bool placeExactLeaf(BuildNode& node) {
    if (!setup_.exactCells) return true;
    const auto smooth = [&](const Box& cell) { return refiner_.smoothFit(cell); };
    for (;;) {
      ExactCells::Outcome outcome =
          chooseExact(boxOf(node), *setup_.exactCells, smooth, int(node.depth) < options_.maxDepth);
      if (outcome.fit) node.fit = std::move(*outcome.fit);
      if (!outcome.divides) return true;
      CellStep step{.stage = CellStage::exactLeaves, .choice = CellChoice::divide, .listIsTooLong = true};
      setPlace(step, node);
      history_.steps.push_back(std::move(step));
      if (int(node.depth) == target_.cell().depth) return false;
      node = nodeAt(int(node.depth) + 1, {});
    }
  }

  /// Returns true if this leaf, as it is, becomes the leaf of the field, by pruning and a final rise of the degree.
  bool reaches(const BuildNode& node) const {
    const Cell& cell = target_.cell();
    if (int(node.depth) != cell.depth) return false;
    if (node.fit.isExact() || target_.isExact()) return node.fit.isExact() && target_.isExact();
    if (node.fit.isFinal) return node.fit.degree == cell.degree;
    // A pruned leaf has any degree up to that of the projection from which its last fit was made.
    if (isPruned()) return budget_.finalDegree(node.fit.cached.degree) >= cell.degree;
    return budget_.finalDegree(node.fit.degree) == cell.degree;
  }
  /// Returns true if the refinement is known to have gone as far as this leaf. Which projection a pruned leaf was cut
  /// from shows in its coefficients.
  bool isFound(const BuildNode& node) const {
    if (!reaches(node)) return false;
    const bool isComparable = isPruned() && !node.fit.isFinal && !options_.enrich && !options_.continuityWeight;
    return !isComparable || target_.holds(pruned(node.fit));
  }
  /// Returns the fit that pruning makes of a fit which reaches the leaf of the field.
  Fit pruned(const Fit& fit) const {
    const int degree = options_.enrich ? lowestWithFinal(target_.cell().degree) : target_.cell().degree;
    Fit lowered;
    lowered.degree = degree;
    lowered.coefficients = basis::truncated(fit.cached.coefficients, fit.cached.degree, degree);
    return lowered;
  }
  bool isBeyond(const BuildNode& node) const {
    const Cell& cell = target_.cell();
    if (int(node.depth) != cell.depth) return int(node.depth) > cell.depth;
    return !target_.isExact() && !isPruned() && node.fit.degree > cell.degree;
  }

  /// Makes the leaf after a refinement of `visited`. Returns std::nullopt if there is none on the way to the leaf of
  /// the field.
  std::optional<BuildNode> next(Visited& visited) const {
    const int depth = int(visited.node.depth);
    Trial& trial = *visited.trial;
    if (trial.exact) return nodeAt(depth, *trial.exact);
    if (visited.raises) return nodeAt(depth, *trial.raised);
    if (!trial.children || depth >= target_.cell().depth) return std::nullopt;
    return nodeAt(depth + 1, (*trial.children)[target_.childBelow(depth)]);
  }

  Visited tryRefinement(BuildNode node) const {
    Visited visited{.node = std::move(node)};
    const std::optional<Refinement> allowed = refiner_.allowed(visited.node);
    if (!allowed) return visited;
    visited.trial = refiner_.attempt(visited.node, *allowed);
    visited.raises = !visited.trial->exact && refiner_.raises(visited.node, *visited.trial);
    return visited;
  }

  /// Follows the refinement by errors from a first fit. Returns the cells on the way; the last one is the leaf of the
  /// field, unless the refinement leads elsewhere.
  std::vector<Visited> followErrors(BuildNode node) const {
    std::vector<Visited> way;
    const bool grows = !options_.targetError.isNone() || !(options_.maxError > 0);
    for (;;) {
      progress_.throwIfCancelled();
      way.push_back(tryRefinement(std::move(node)));
      if (!grows || !way.back().trial || isFound(way.back().node) || isBeyond(way.back().node)) return way;
      if (isPruned() && dividesLeaf(way.back())) {
        // Of a divided cell, pruning knows the fit of the degree that was tried in place of the division.
        way.push_back({.node = nodeAt(target_.cell().depth, *way.back().trial->raised)});
        return way;
      }
      std::optional<BuildNode> after = next(way.back());
      if (!after) return way;
      node = std::move(*after);
    }
  }

  bool isPruned() const { return options_.criterion == Criterion::optimal; }
  /// Returns true if a cell was divided that is a leaf of the field.
  bool dividesLeaf(const Visited& visited) const {
    return int(visited.node.depth) == target_.cell().depth && !visited.raises && !visited.trial->exact;
  }

  /// Follows the pass for the maximum error. Returns an empty way if it does not lead to the leaf of the field.
  /// `isCutOff` means that a limit ended the pass before all cells were refined.
  std::vector<Visited> followProbes(BuildNode node, bool isCutOff) const {
    std::vector<Visited> way;
    for (;;) {
      progress_.throwIfCancelled();
      Probed probed = probe(refiner_, node);
      way.push_back({std::move(node), std::move(probed.trial), probed.raises, CellStage::maxError});
      if (!way.back().trial || (isCutOff && reaches(way.back().node))) break;
      std::optional<BuildNode> after = next(way.back());
      if (!after || isBeyond(*after)) return {};
      node = std::move(*after);
    }
    return reaches(way.back().node) ? way : std::vector<Visited>();
  }

  BuildNode refine(BuildNode first) {
    std::vector<Visited> way = followErrors(std::move(first));
    // When the refinement by errors ended is not known. The pass for the maximum error went on from the last of its
    // leaves from which it leads to the leaf of the field.
    if (options_.maxError > 0 && !goOnByProbes(way, false)) goOnByProbes(way, true);
    // It is not known whether a leaf that was pruned had been refined further: `finish` records what became of it.
    const std::size_t known = isPruned() && !way.back().node.fit.isFinal ? way.size() - 1 : way.size();
    for (std::size_t i = 0; i < known; ++i) record(way[i], i + 1 == way.size());
    history_.isAtLimit = !refiner_.allowed(way.back().node) && !way.back().node.fit.isFinal;
    return std::move(way.back().node);
  }

  /// Replaces the end of the refinement by errors by what the pass for the maximum error makes of it. Returns false if
  /// that does not lead to the leaf of the field.
  bool goOnByProbes(std::vector<Visited>& way, bool isCutOff) const {
    for (std::size_t ended = way.size(); ended-- > 0;) {
      std::vector<Visited> rest = followProbes(way[ended].node, isCutOff);
      if (rest.empty()) continue;
      way.resize(ended);
      std::ranges::move(rest, std::back_inserter(way));
      return true;
    }
    return false;
  }

  /// Records what follows the refinement, and whether it leads to the leaf of the field.
  void finish(BuildNode& node) {
    const Cell& cell = target_.cell();
    if (!reaches(node)) return;
    if (isPruned() && !node.fit.isFinal) {
      node.fit = pruned(node.fit);
      keep(node, CellStage::pruning);
    }
    if (options_.enrich && !node.fit.isFinal && node.fit.degree < cell.degree) {
      node.fit = fitter_.fit(boxOf(node), cell.degree);
      keep(node, CellStage::enrichment);
    }
    history_.agrees = options_.continuityWeight || target_.holds(node.fit);
  }

  int lowestWithFinal(int degree) const {
    for (int lower = std::max(0, degree - 1); lower < degree; ++lower)
      if (budget_.finalDegree(lower) == degree) return lower;
    return degree;
  }

  void setPlace(CellStep& step, const BuildNode& node) const {
    step.depth = int(node.depth);
    step.box = boxOf(node);
  }

  CellStep stepAt(const BuildNode& node, CellStage stage) const {
    CellStep step{.stage = stage};
    setPlace(step, node);
    step.degree = node.fit.degree;
    step.triangles = node.fit.list.triangles.size();
    step.isOutsideBand = node.fit.outsideBand;
    step.isWithoutError = node.fit.isExact() || (node.fit.isFinal && !(options_.exactTolerance > 0));
    step.weighted = node.fit.error.weighted / scale_;
    if (node.fit.isExact()) {
      step.estimatedRms = step.measuredRms = step.measuredMax = 0;
      return step;
    }
    if (node.fit.error.volume > 0) step.estimatedRms = std::sqrt(node.fit.error.squared / node.fit.error.volume);
    CellMeasure(distance_, step.box, progress_).rate(node.fit, step);
    return step;
  }

  void keep(const BuildNode& node, CellStage stage) { history_.steps.push_back(stepAt(node, stage)); }

  void record(const Visited& visited, bool isLast) {
    const BuildNode& node = visited.node;
    CellStep step = stepAt(node, visited.stage);
    if (visited.trial) compare(visited, step);
    if (!isLast) step.choice = visited.raises || visited.trial->exact ? CellChoice::raise : CellChoice::divide;
    history_.steps.push_back(std::move(step));
  }

  void compare(const Visited& visited, CellStep& step) const {
    const Fit& fit = visited.node.fit;
    const Trial& trial = *visited.trial;
    const double coefficientBytes = averageCoefficientBytes_;
    step.listIsTooLong = setup_.exactCells && !options_.maxBytes && !trial.exact;
    if (trial.exact) {
      step.exactTrial = CellAlternative{.bytes = listBytesOf(packedWords(trial.exact->list, trial.exact->sign), 0)};
      step.triangles = trial.exact->list.triangles.size();
      return;
    }
    const Gains gains = gainsOf(fit, trial, options_.estimator);
    const std::optional<Refinement> allowed = refiner_.allowed(visited.node);
    if (trial.raised && allowed != Refinement::octree) {
      step.trialDegree = fit.degree + 1;
      const double added = double(budget_.finalCoefficients(fit.degree + 1)) - double(budget_.finalCoefficients(fit));
      step.degreeTrial = CellAlternative{.bytes = added * coefficientBytes,
                                         .error = trial.raised->error.weighted / scale_,
                                         .gain = *gains.degree / coefficientBytes / scale_};
    }
    if (trial.children) {
      double error = 0;
      for (const Fit& child : *trial.children) error += child.error.weighted;
      step.octreeTrial = CellAlternative{
          .bytes = 8 * budget_.nodeBytes() + 7 * double(budget_.finalCoefficients(fit)) * coefficientBytes,
          .error = error / scale_,
          .gain = *gains.octree / coefficientBytes / scale_};
    }
  }

  const DistanceFunction& distance_;
  const Target& target_;
  const Progress& progress_;
  const BuildOptions& options_;
  ConstructionState state_;
  ByteBudget budget_;
  ConstructionSetup setup_;
  CellFitter fitter_;
  GrowthObserver observer_ = {};
  Refiner refiner_;
  double scale_;
  double averageCoefficientBytes_;  ///< in the finished field
  CellHistory history_;
};

/// Repeats the search for the fewest bytes within a tolerance for one leaf.
class ToleranceReplay {
 public:
  ToleranceReplay(const Field& field, const BuildOptions& options, const DistanceFunction& distance,
                  const Target& target, const Progress& progress)
      : field_(field),
        distance_(distance),
        target_(target),
        progress_(progress),
        options_(options),
        setup_(distance, field.domain(), options_, progress),
        cells_(setup_.tree, setup_.fitter, setup_.exact, setup_.maxDepth, setup_.budget,
               [this](std::uint64_t) { progress_.throwIfCancelled(); }) {}

  CellHistory run() {
    CellHistory history{.cell = target_.cell()};
    double ratioAbove = 0;
    for (int depth = 0; depth <= target_.cell().depth; ++depth) {
      const CellPlace place = target_.at(depth);
      const bool isLeaf = depth == target_.cell().depth;
      CheapCell cell;
      std::vector<LeafTrial> trials;
      const bool mayDivide = cells_.makeLeaf(cell, place, ratioAbove, &trials);
      CellStep step = stepOf(place, trials);
      if (isLeaf && cell.bytes < std::numeric_limits<double>::infinity()) {
        step.degree = cell.fit.degree;
        if (cell.fit.isExact()) step.triangles = cell.fit.list.triangles.size();
        step.isWithoutError = cell.leafRatio == 0;
        step.isMissed = cell.isMissed;
        if (cell.fit.isExact())
          step.measuredRms = step.measuredMax = 0;
        else
          CellMeasure(distance_, step.box, progress_).rate(cell.fit, step);
      }
      if (isLeaf) history.agrees = target_.holds(cell.fit);
      if (!isLeaf) {
        step.choice = CellChoice::divide;
        step.octreeTrial = CellAlternative{.bytes = bytesBelow(target_.nodeAt(place), place)};
      } else if (mayDivide) {
        step.octreeTrial = childrenOf(cell, place);
        history.agrees = history.agrees && step.octreeTrial->bytes >= cell.bytes;
      }
      ratioAbove = cell.ratio;
      history.steps.push_back(std::move(step));
      if (!isLeaf && !mayDivide) break;  // the field is divided where the replay has a leaf
    }
    return history;
  }

 private:
  CellStep stepOf(const CellPlace& place, std::span<const LeafTrial> trials) const {
    CellStep step{.stage = CellStage::tolerance, .depth = int(place.depth), .box = setup_.tree.boxOf(place)};
    for (const LeafTrial& trial : trials) {
      const CellAlternative alternative{.bytes = trial.bytes,
                                        .error = trial.ratio,
                                        .isRejected = trial.isRejected,
                                        .isUnproven = trial.isRejected && trial.ratio <= kMostRatio};
      if (trial.bytes == std::numeric_limits<double>::infinity()) {
        step.listIsTooLong = true;
      } else if (trial.degree == kExactDegree) {
        step.exactTrial = alternative;
        step.triangles = trial.triangles;
      } else {
        step.degreeTrial = alternative;
        step.trialDegree = trial.degree;
      }
    }
    return step;
  }

  /// Returns the bytes that the children of a leaf would take. The search for them ends as soon as they take more than
  /// the leaf; the result is then only a lower bound.
  CellAlternative childrenOf(const CheapCell& leaf, const CellPlace& place) const {
    double bytes = setup_.budget.nodeBytes();
    for (std::uint32_t child = 0; child < 8 && bytes < leaf.bytes; ++child) {
      CheapCell cell;
      cells_.solve(cell, place.child(child), leaf.ratio);
      bytes += cell.bytes;
    }
    return CellAlternative{.bytes = bytes};
  }

  /// Returns the bytes of the field's nodes below a node, as the construction counts them.
  double bytesBelow(std::uint32_t node, const CellPlace& place) const {
    const std::uint64_t bits = field_.data().nodes[node];
    if (!node::isLeaf(bits)) {
      double bytes = setup_.budget.nodeBytes();
      for (std::uint32_t child = 0; child < 8; ++child)
        bytes += bytesBelow(node::firstChild(bits) + child, place.child(child));
      return bytes;
    }
    if (!node::isExact(bits)) {
      const int degree = node::degree(bits);
      return withCoefficients(field_.data(), bits, [&](const auto* c) {
        return cells_.polynomialBytes(std::vector<double>(c, c + coefficientCount(degree)), degree);
      });
    }
    return setup_.budget.nodeBytes() + listBytes(bits, setup_.tree.boxOf(place));
  }

  double listBytes(std::uint64_t leaf, const Box& box) const {
    const ExactTriangles& exact = field_.data().exact;
    const TriangleListView list(exact, leaf);
    const std::size_t words = std::size_t(list.referenceWords() - &exact.lists[node::offset(leaf)]) +
                              (list.hasReference() ? TriangleListView::kReferenceWords : 0);
    std::size_t owned = 0;
    forEachTriangle(exact, leaf, [&](std::uint32_t triangle) {
      const std::uint32_t corner = exact.triangles[triangle][0];
      owned +=
          std::visit([&](const auto& v) { return box.contains(v[corner].template cast<double>()); }, exact.vertices);
    });
    return listBytesOf(words, owned);
  }

  const Field& field_;
  const DistanceFunction& distance_;
  const Target& target_;
  const Progress& progress_;
  const BuildOptions& options_;
  ToleranceSetup setup_;
  LeastBytes cells_;
};

}  // namespace

CellHistory cellHistory(const Field& field, const DistanceFunction& distance, const Vector3& x,
                        const Progress& progress) {
  if (!x.allFinite() || !field.domain().contains(x)) throw Error("the point lies outside the field's domain");
  BuildOptions options = settingsOf(field.data());
  if (!(options.tolerance > 0) && !field.metadata().hasEstimate())
    throw Error("the field was changed after it was built within a tolerance, and does not tell any more how");
  const Target target(field, x);
  if (options.tolerance > 0) return ToleranceReplay(field, options, distance, target, progress).run();
  // A damaged file may hold any settings. A number of steps is a goal, if the file stores no other.
  options.maxSteps = 0;
  checkOptions(field.domain(), options);
  options.maxSteps.reset();
  return RefinementReplay(field, options, distance, target, progress).run();
}

}  // namespace hpsdf
