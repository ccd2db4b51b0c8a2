#include "field/build/prune.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "basis/projection.h"

namespace hpsdf {
namespace {

constexpr std::uint8_t kSplit = 0xff;  ///< in place of a degree: the node's children stand for it
constexpr int kHalvings = 60;          // of the span of λ in logarithms: to its last bits

/// Squared error of a node for each degree that its spare coefficients carry, from the lowest up.
std::vector<double> squaredErrors(const Fit& fit) {
  std::vector<double> left(fit.spare.degree + 1, 0.0);
  forEachCoefficient(fit.spare.degree, [&](int i, int j, int k, int index) {
    const double c = fit.spare.coefficients[index];
    left[i + j + k] += c * c * squaredNorm(i, j, k);
  });
  double rest = fit.spare.meanSquare;
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
        chosen_(tree.nodes.size()) {
    tbb::parallel_for(std::size_t{0}, tree.nodes.size(), [&](std::size_t n) {
      const Fit& fit = tree.nodes[n].fit;
      squared_[n] = squaredErrors(fit);
      weight_[n] = fit.outsideBand ? 0 : nearness.weight(fit.coefficients[0]);
    });
  }

  void run() {
    double lambda = greatestLambda([&](const Totals& totals) { return limits_.goal.reached(totals.errors); });
    if (limits_.mostBytes) lambda = std::max(lambda, leastLambda());
    choose(lambda);
    cut();
  }

 private:
  struct Totals {
    ErrorTotals errors;
    double bytes = 0;
  };

  CellError errorAt(std::size_t n, int degree) const {
    CellError error = tree_.nodes[n].fit.error;
    error.squared = squared_[n][degree];
    error.weighted = weight_[n] * error.squared;
    return error;
  }

  /// The best for this λ, from the leaves up: children come after their parents.
  void choose(double lambda) {
    std::vector<double> cost(tree_.nodes.size());
    for (std::size_t n = tree_.nodes.size(); n-- > 0;) {
      const int top = std::min<int>(limits_.mostDegree, tree_.nodes[n].fit.spare.degree);
      // outside of the narrow band no error counts, and nothing would be left of what is there
      const int low = tree_.nodes[n].fit.outsideBand ? tree_.nodes[n].fit.degree : std::min(limits_.leastDegree, top);
      const std::uint32_t first = tree_.nodes[n].firstChild;
      cost[n] = HUGE_VAL;
      for (int degree = low; degree <= top; ++degree) {
        const double here = weight_[n] * squared_[n][degree] + lambda * limits_.leafBytes[degree];
        if (here >= cost[n]) continue;
        cost[n] = here;
        chosen_[n] = static_cast<std::uint8_t>(degree);
      }
      if (first == 0) continue;
      double below = lambda * limits_.nodeBytes;
      for (std::uint32_t child = first; child < first + 8; ++child) below += cost[child];
      if (below >= cost[n]) continue;
      cost[n] = below;
      chosen_[n] = kSplit;
    }
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
          sum.bytes += limits_.leafBytes[chosen_[n]];
          sum.errors.add(errorAt(n, chosen_[n]));
        }
      }
    }
    return sum;
  }

  /// Errors a byte between which λ lies.
  std::pair<double, double> span() const {
    double most = 0;
    for (std::size_t n = 0; n < squared_.size(); ++n) most = std::max(most, weight_[n] * squared_[n].front());
    return {1e-30 * most, most};
  }

  /// The greatest λ whose tree is `good`, or the least of the span: with λ the error grows.
  template <typename Good>
  double greatestLambda(const Good& good) {
    auto [low, high] = span();
    for (int i = 0; i < kHalvings && low > 0; ++i) {
      const double middle = std::sqrt(low * high);
      choose(middle);
      (good(totals()) ? low : high) = middle;
    }
    return low;
  }

  /// The least λ whose tree has few enough bytes.
  double leastLambda() {
    auto [low, high] = span();
    for (int i = 0; i < kHalvings && low > 0; ++i) {
      const double middle = std::sqrt(low * high);
      choose(middle);
      (totals().bytes <= *limits_.mostBytes ? high : low) = middle;
    }
    return high;
  }

  /// Makes the tree what was chosen.
  void cut() {
    BuildTree kept;
    kept.domain = tree_.domain;
    kept.grid = tree_.grid;
    const std::size_t base = tree_.baseCells();
    for (std::size_t n = 0; n < base; ++n) take(kept, n);
    for (std::size_t n = 0; n < kept.nodes.size(); ++n) {  // grows
      const std::uint32_t from = kept.nodes[n].firstChild;
      if (from == 0) continue;
      kept.nodes[n].firstChild = static_cast<std::uint32_t>(kept.nodes.size());
      for (std::uint32_t child = from; child < from + 8; ++child) take(kept, child);
    }
    tree_ = std::move(kept);
  }

  void take(BuildTree& kept, std::size_t n) {
    BuildNode node = std::move(tree_.nodes[n]);
    if (chosen_[n] == kSplit) {
      node.fit = Fit{};
    } else {
      node.firstChild = 0;
      node.fit.error = errorAt(n, chosen_[n]);
      node.fit.degree = chosen_[n];
      node.fit.coefficients = truncated(node.fit.spare.coefficients, node.fit.spare.degree, chosen_[n]);
      node.fit.spare = {};
    }
    kept.nodes.push_back(std::move(node));
  }

  BuildTree& tree_;
  const PruneLimits& limits_;
  std::vector<std::vector<double>> squared_;  ///< by node, by degree
  std::vector<double> weight_;
  std::vector<std::uint8_t> chosen_;  ///< a leaf's degree, or kSplit
};

}  // namespace

void prune(BuildTree& tree, const Nearness& nearness, const PruneLimits& limits) {
  Pruning(tree, nearness, limits).run();
}

}  // namespace hpsdf
