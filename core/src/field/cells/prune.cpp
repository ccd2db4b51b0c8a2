#include "field/cells/prune.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "basis/projection.h"
#include "field/query/quantized.h"

namespace hpsdf::detail {
namespace {

constexpr std::uint8_t kSplit = 0xff;  ///< value in place of a degree for a node that stays split
constexpr int kHalvings = 60;          // bisections of the range of log λ; they determine λ to its last bits

/// Returns the squared errors that a node has as a leaf of degree 0, 1, … up to the degree of its cached
/// projection.
std::vector<double> squaredErrors(const Fit& fit) {
  std::vector<double> left(fit.cached.degree + 1, 0.0);
  basis::forEachCoefficient(fit.cached.degree, [&](int i, int j, int k, int index) {
    const double c = fit.cached.coefficients[index];
    left[i + j + k] += c * c * basis::squaredNorm(i, j, k);
  });
  double rest = fit.cached.meanSquare;
  for (double& shell : left) {
    rest -= shell;
    shell = std::max(rest, 0.0) * fit.error.volume;
  }
  return left;
}

class Pruning {
 public:
  Pruning(BuildTree& tree, const Nearness& nearness, const PruneLimits& limits)
      : tree_(tree),
        limits_(limits),
        squared_(tree.nodes.size()),
        weight_(tree.nodes.size()),
        bytes_(tree.nodes.size()),
        chosen_(tree.nodes.size()) {
    tbb::parallel_for(std::size_t{0}, tree.nodes.size(), [&](std::size_t n) {
      const Fit& fit = tree.nodes[n].fit;
      chosen_[n] = tree.nodes[n].firstChild == 0 ? static_cast<std::uint8_t>(fit.degree) : kSplit;
      if (isFixed(n)) return;
      squared_[n] = squaredErrors(fit);
      weight_[n] = fit.outsideBand ? 0 : nearness.weight(fit.coefficients[0]);
    });
  }

  void run() {
    // The bytes of quantized coefficients depend on their step, which depends on the error of the pruned tree.
    const int rounds = limits_.quantization ? 3 : 1;
    for (int round = 0; round < rounds; ++round) {
      countBytes();
      chooseAll();
    }
    cut();
  }

 private:
  struct Totals {
    ErrorTotals errors;
    double bytes = 0;
    QuantizedPart part;
  };

  /// Chooses the pruned tree. λ is the error that is worth one byte: with a greater λ the error grows and the bytes
  /// fall. Takes the greatest λ that keeps the error goal or, if greater, the least λ that keeps the limit of bytes.
  void chooseAll() {
    double lambda = bracket([&](const Totals& sum) { return limits_.goal.reached(sum.errors); }).first;
    if (limits_.mostBytes)
      lambda = std::max(lambda, bracket([&](const Totals& sum) { return sum.bytes > *limits_.mostBytes; }).second);
    choose(lambda);
  }

  /// Computes the bytes of all nodes as leaves of each degree, with the step that suits the tree as it is chosen now.
  void countBytes() {
    double forRms = 0;
    if (limits_.quantization) {
      const Totals sum = totals();
      forRms = limits_.quantization->stepForRms(sum.part, std::sqrt(sum.errors.weighted / tree_.domain.volume()));
    }
    tbb::parallel_for(std::size_t{0}, tree_.nodes.size(), [&](std::size_t n) { bytes_[n] = leafBytes(n, forRms); });
  }

  /// Returns the bytes of a node as a leaf of each degree that it may have, from 0 on. A leaf that stays as it is has
  /// only one element, and lists of triangles count elsewhere.
  std::vector<float> leafBytes(std::size_t n, double forRms) const {
    const Fit& fit = tree_.nodes[n].fit;
    if (fit.isExact()) return {float(limits_.nodeBytes)};
    const std::vector<double>& c = isFixed(n) ? fit.coefficients : fit.cached.coefficients;
    if (c.empty()) return {};
    const int top = isFixed(n) ? fit.degree : fit.cached.degree;
    std::vector<float> bytes(std::size_t(top) + 1);
    if (!limits_.quantization) {
      for (int degree = 0; degree <= top; ++degree)
        bytes[degree] = float(limits_.nodeBytes + limits_.coefficientBytes * limits_.coefficients[degree]);
    } else {
      const double step = std::min(forRms, limits_.quantization->greatestStep(c, top));
      const auto quantized = query::quantizedBytesByDegree(c, top, step);
      for (int degree = 0; degree <= top; ++degree) {
        // Where degrees are raised at the end, the additional coefficients are not known yet.
        const double more = limits_.coefficients[degree] / coefficientCount(degree);
        bytes[degree] = float(limits_.nodeBytes + more * quantized[degree]);
      }
    }
    return isFixed(n) ? std::vector{bytes.back()} : bytes;
  }

  /// Returns true for a leaf without error, which stays as it is, and for a node that was split before it had a fit,
  /// which stays split.
  bool isFixed(std::size_t n) const { return tree_.nodes[n].fit.cached.coefficients.empty(); }

  CellError errorAt(std::size_t n, int degree) const {
    CellError error = tree_.nodes[n].fit.error;
    if (isFixed(n)) return error;
    error.squared = squared_[n][degree];
    error.weighted = weight_[n] * error.squared;
    return error;
  }

  /// Chooses for each node whether it stays split or which degree it gets as a leaf, so that error + λ·bytes is
  /// least. Works from the leaves up: in the array of nodes, children come after their parents.
  void choose(double lambda) {
    std::vector<double> cost(tree_.nodes.size());
    for (std::size_t n = tree_.nodes.size(); n-- > 0;) {
      cost[n] = chooseDegree(n, lambda);
      const std::uint32_t first = tree_.nodes[n].firstChild;
      if (first == 0) continue;
      double below = lambda * limits_.nodeBytes;
      for (std::uint32_t child = first; child < first + 8; ++child) below += cost[child];
      if (below >= cost[n] && !isFixed(n)) continue;
      cost[n] = below;
      chosen_[n] = kSplit;
    }
  }

  /// Chooses the best degree of node n as a leaf, and returns the cost of the node with this degree.
  double chooseDegree(std::size_t n, double lambda) {
    const Fit& fit = tree_.nodes[n].fit;
    if (isFixed(n)) {
      chosen_[n] = static_cast<std::uint8_t>(fit.degree);
      return lambda * (fit.coefficients.empty() && !fit.isExact() ? 0 : bytes_[n].back() + bytesOf(fit.list));
    }
    const int top = std::min<int>(limits_.mostDegree, fit.cached.degree);
    // Keep the degree of a cell outside the narrow band. Its error does not count, so that pruning would choose
    // the lowest degree.
    const int low = fit.outsideBand ? fit.degree : std::min(limits_.leastDegree, top);
    double least = HUGE_VAL;
    for (int degree = low; degree <= top; ++degree) {
      const double cost = weight_[n] * squared_[n][degree] + lambda * bytes_[n][degree];
      if (cost >= least) continue;
      least = cost;
      chosen_[n] = static_cast<std::uint8_t>(degree);
    }
    return least;
  }

  Totals totals() const {
    Totals sum;
    std::vector<std::uint32_t> stack;
    for (std::uint32_t base = 0; base < tree_.baseCells(); ++base) {
      stack.push_back(base);
      while (!stack.empty()) {
        const std::uint32_t n = stack.back();
        stack.pop_back();
        if (chosen_[n] == kSplit) {
          sum.bytes += limits_.nodeBytes;
          for (std::uint32_t child = 0; child < 8; ++child) stack.push_back(tree_.nodes[n].firstChild + child);
        } else {
          const bool isExact = tree_.nodes[n].fit.isExact();
          if (!bytes_[n].empty()) sum.bytes += isFixed(n) ? bytes_[n].back() : bytes_[n][chosen_[n]];
          sum.errors.add(errorAt(n, chosen_[n]));
          if (!isExact) sum.part.add(tree_.boxOf(tree_.nodes[n]).volume(), coefficientCount(chosen_[n]));
        }
      }
    }
    return sum;
  }

  /// Finds by bisection the λ, in squared error per byte, at which isBelow(totals of the pruned tree) changes
  /// from true to false. Returns the values just below and just above the change. If there is no change, both are
  /// at one end of the range of λ.
  template <typename IsBelow>
  std::pair<double, double> bracket(const IsBelow& isBelow) {
    double high = 0;
    for (std::size_t n = 0; n < squared_.size(); ++n)
      if (!isFixed(n)) high = std::max(high, weight_[n] * squared_[n].front());
    double low = 1e-30 * high;
    for (int i = 0; i < kHalvings && low > 0; ++i) {
      const double middle = std::sqrt(low * high);
      choose(middle);
      (isBelow(totals()) ? low : high) = middle;
    }
    return {low, high};
  }

  /// Replaces the tree by the pruned tree that was chosen.
  void cut() {
    BuildTree kept;
    kept.domain = tree_.domain;
    kept.grid = tree_.grid;
    const std::size_t base = tree_.baseCells();
    for (std::size_t n = 0; n < base; ++n) take(kept, n);
    for (std::size_t n = 0; n < kept.nodes.size(); ++n) {  // take() appends nodes to the list
      const std::uint32_t from = kept.nodes[n].firstChild;
      if (from == 0) continue;
      kept.nodes[n].firstChild = static_cast<std::uint32_t>(kept.nodes.size());
      for (std::uint32_t child = from; child < from + 8; ++child) take(kept, child);
    }
    tree_ = std::move(kept);
  }

  void take(BuildTree& kept, std::size_t n) {
    const bool wasFixed = isFixed(n);
    const CellError error = chosen_[n] == kSplit ? CellError{} : errorAt(n, chosen_[n]);
    BuildNode node = std::move(tree_.nodes[n]);
    if (chosen_[n] == kSplit) {
      node.fit = Fit{};
    } else if (!wasFixed) {
      node.firstChild = 0;
      node.fit.error = error;
      node.fit.degree = chosen_[n];
      node.fit.coefficients = basis::truncated(node.fit.cached.coefficients, node.fit.cached.degree, chosen_[n]);
      node.fit.cached = {};
    }
    kept.nodes.push_back(std::move(node));
  }

  BuildTree& tree_;
  const PruneLimits& limits_;
  std::vector<std::vector<double>> squared_;  ///< squared errors by node and degree
  std::vector<double> weight_;
  std::vector<std::vector<float>> bytes_;  ///< by node and degree
  std::vector<std::uint8_t> chosen_;       ///< for each node, its degree as a leaf or kSplit
};

}  // namespace

void prune(BuildTree& tree, const Nearness& nearness, const PruneLimits& limits) {
  Pruning(tree, nearness, limits).run();
}

}  // namespace hpsdf::detail
