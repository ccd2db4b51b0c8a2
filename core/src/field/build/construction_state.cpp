#include "field/build/construction_state.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "field/build/limits.h"

namespace hpsdf::detail {
namespace {

/// Bits that tell which parts of a fit follow.
enum : std::uint8_t { kFitted = 1, kOutsideBand = 2, kNear = 4, kCached = 8, kAllBits = 15 };

void coefficientItems(detail::CheckedWriter& writer, int degree, const std::vector<double>& coefficients) {
  writer.item(static_cast<std::uint8_t>(degree));
  writer.array(std::span(coefficients));
}

void finiteItem(detail::CheckedReader& reader, double& value) {
  reader.item(value);
  if (!std::isfinite(value)) reader.damaged("a number is not finite");
}

void coefficientItems(detail::CheckedReader& reader, int& degree, std::vector<double>& coefficients, int least,
                      int most) {
  std::uint8_t stored = 0;
  reader.item(stored);
  if (stored < least || stored > most) reader.damaged("a degree is out of range");
  degree = stored;
  reader.array(coefficients, static_cast<std::uint64_t>(coefficientCount(degree)));
  if (!std::ranges::all_of(coefficients, [](double c) { return std::isfinite(c); }))
    reader.damaged("a number is not finite");
}

void fitItems(detail::CheckedWriter& writer, const Fit& fit) {
  const auto bit = [](bool set, std::uint8_t value) { return set ? value : std::uint8_t{0}; };
  const bool isFitted = !fit.coefficients.empty(), isCached = !fit.cached.coefficients.empty();
  writer.item(static_cast<std::uint8_t>(bit(isFitted, kFitted) | bit(fit.outsideBand, kOutsideBand) |
                                        bit(fit.error.near, kNear) | bit(isCached, kCached)));
  if (isFitted) {
    writer.item(fit.error.weighted);
    writer.item(fit.error.squared);
    writer.item(fit.error.volume);
    coefficientItems(writer, fit.degree, fit.coefficients);
  }
  if (isCached) {
    writer.item(fit.cached.meanSquare);
    coefficientItems(writer, fit.cached.degree, fit.cached.coefficients);
  }
}

void fitItems(detail::CheckedReader& reader, Fit& fit, int mostDegree) {
  std::uint8_t parts = 0;
  reader.item(parts);
  if (parts > kAllBits) reader.damaged("a cell's bits are unknown");
  fit.outsideBand = (parts & kOutsideBand) != 0;
  fit.error.near = (parts & kNear) != 0;
  if ((parts & kFitted) != 0) {
    finiteItem(reader, fit.error.weighted);
    finiteItem(reader, fit.error.squared);
    finiteItem(reader, fit.error.volume);
    coefficientItems(reader, fit.degree, fit.coefficients, 1, mostDegree);
  }
  if ((parts & kCached) != 0) {
    finiteItem(reader, fit.cached.meanSquare);
    coefficientItems(reader, fit.cached.degree, fit.cached.coefficients, fit.degree, kMaxDegree + 1);
  }
}

/// Gives the cells below the base their cell indices. Each group of eight must have one parent, which precedes it.
void setCellIndices(const detail::CheckedReader& reader, BuildTree& tree, int maxDepth) {
  std::vector<bool> hasParent(tree.nodes.size());
  for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
    if (n >= tree.baseCells() && !hasParent[n]) reader.damaged("a cell has no parent");
    const std::uint64_t first = tree.nodes[n].firstChild;
    if (first == 0) continue;
    const bool isGroup = first > n && first >= tree.baseCells() && first + 8 <= tree.nodes.size() &&
                         (first - tree.baseCells()) % 8 == 0 && !hasParent[first];
    if (!isGroup || int(tree.nodes[n].depth) >= maxDepth) reader.damaged("a cell's children are not its own");
    for (std::uint64_t child = first; child < first + 8; ++child) hasParent[child] = true;
    tree.setChildIndices(static_cast<std::uint32_t>(n));
  }
}

/// Throws `Error` where a cell lacks a polynomial that the construction needs, or has one that it cannot have.
void checkFits(const detail::CheckedReader& reader, const BuildTree& tree, std::uint64_t fittedBaseCells,
               bool keepsAll) {
  for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
    const BuildNode& node = tree.nodes[n];
    const bool isFitted = !node.fit.coefficients.empty(), isCached = !node.fit.cached.coefficients.empty();
    const bool isUnfitted = n < tree.baseCells() && n >= fittedBaseCells;
    const bool needsFit = !isUnfitted && (node.firstChild == 0 || keepsAll);
    if ((needsFit && !isFitted) || (isUnfitted && (isFitted || node.firstChild != 0)) ||
        isCached != (isFitted && keepsAll))
      reader.damaged("a cell lacks its polynomial or has one too many");
  }
}

void treeItems(detail::CheckedWriter& writer, const BuildTree& tree) {
  writer.item(std::uint64_t{tree.nodes.size()});
  for (const BuildNode& node : tree.nodes) {
    writer.item(node.firstChild);
    fitItems(writer, node.fit);
  }
}

void treeItems(detail::CheckedReader& reader, BuildTree& tree, std::uint64_t fittedBaseCells,
               const BuildOptions& options) {
  constexpr std::uint64_t kLeastBytes = sizeof(std::uint32_t) + 1;  // of a node
  const std::uint64_t base = tree.baseCells();
  std::uint64_t count = 0;
  reader.item(count);
  if (count < base || (count - base) % 8 != 0 || count > 0xffffffffu || count > reader.remaining() / kLeastBytes ||
      fittedBaseCells > base || (fittedBaseCells < base && count > base))
    reader.damaged("it has a number of cells that cannot be");
  requireMemory({.nodes = count, .coefficients = reader.remaining() / sizeof(double)}, options);
  tree.addBaseCells();
  tree.nodes.resize(count);
  for (BuildNode& node : tree.nodes) {
    reader.item(node.firstChild);
    fitItems(reader, node.fit, options.maxDegree);
  }
  setCellIndices(reader, tree, options.maxDepth);
  checkFits(reader, tree, fittedBaseCells, options.criterion == Criterion::optimal);
}

void listItems(detail::CheckedWriter& writer, const std::vector<std::uint32_t>& nodes) {
  writer.item(std::uint64_t{nodes.size()});
  writer.array(std::span(nodes));
}

void listItems(detail::CheckedReader& reader, std::vector<std::uint32_t>& nodes) {
  std::uint64_t count = 0;
  reader.item(count);
  reader.array(nodes, count);
}

/// Every scalar of the state, in order. `State` is const when writing.
template <typename Stream, typename State, typename Evaluations>
void scalarItems(Stream& stream, State& state, Evaluations& evaluations) {
  stream.item(state.stage);
  stream.item(state.fittedBaseCells);
  stream.item(state.steps);
  stream.item(evaluations);
  stream.item(state.nearness.kind);
  stream.item(state.nearness.exponent);
  for (auto* number : {&state.totals.weighted, &state.totals.nearSquared, &state.totals.nearVolume,
                       &state.totals.farSquared, &state.totals.farVolume, &state.lastSum, &state.measuredError})
    stream.item(*number);
  stream.flag(state.isFull);
  stream.item(state.processed);
}

/// Throws `Error` unless these nodes are leaves, each named once.
void requireLeaves(const detail::CheckedReader& reader, const BuildTree& tree, std::span<const std::uint32_t> nodes) {
  std::vector<bool> isNamed(tree.nodes.size());
  for (const std::uint32_t n : nodes) {
    if (n >= isNamed.size() || isNamed[n] || tree.nodes[n].firstChild != 0)
      reader.damaged("it names a cell that is none");
    isNamed[n] = true;
  }
}

}  // namespace

void save(detail::CheckedWriter& writer, const ConstructionState& state, std::uint64_t evaluations) {
  scalarItems(writer, state, evaluations);
  treeItems(writer, state.tree);
  listItems(writer, state.deferred);
  listItems(writer, state.pending);
}

std::uint64_t restore(detail::CheckedReader& reader, ConstructionState& state, const BuildOptions& options,
                      const ByteBudget& budget) {
  std::uint64_t evaluations = 0;
  scalarItems(reader, state, evaluations);
  if (state.stage > ConstructionState::Stage::probe || !state.nearness.isKnown())
    reader.damaged("it is at an unknown stage");
  treeItems(reader, state.tree, state.fittedBaseCells, options);
  listItems(reader, state.deferred);
  listItems(reader, state.pending);
  reader.finish();
  const bool isFitting = state.stage == ConstructionState::Stage::fitBaseCells;
  if ((state.fittedBaseCells < state.tree.baseCells() && !isFitting) || state.processed > state.pending.size())
    reader.damaged("its numbers do not belong together");
  requireLeaves(reader, state.tree, state.deferred);
  requireLeaves(reader, state.tree, std::span(state.pending).subspan(state.processed));
  if (isFitting) return evaluations;
  for (const BuildNode& node : state.tree.nodes)
    if (node.firstChild == 0) state.coefficients += budget.finalCoefficients(node.fit.degree);
  return evaluations;
}

}  // namespace hpsdf::detail
