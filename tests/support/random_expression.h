#pragma once
// Random expressions of solids, which are the same for the same seed on every machine.

#include <cstdint>
#include <utility>
#include <vector>

#include "hpsdf/combine/expression.h"
#include "hpsdf/detail/random_points.h"

namespace hpsdf {

struct RandomExpressionOptions {
  int depth = 3;               ///< greatest number of Boolean operations between the root and a leaf
  double reach = 0.6;          ///< greatest move of a leaf along each axis
  double length = 0.1;         ///< greatest offset, thickness and radius
  bool isBooleanOnly = false;  ///< only unions, intersections and differences of placed leaves
};

namespace random_expression {

/// Returns a leaf that is turned, scaled by 0.6 to 1.2 and moved.
inline Expression placed(detail::Random& random, const std::vector<Expression>& leaves,
                         const RandomExpressionOptions& options) {
  Expression leaf = leaves[random.next() % leaves.size()];
  const double factor = 0.6 + 0.6 * random.unit(), degrees = 360 * random.unit();
  const Vector3 axis = random.inBall(1), by = random.inBall(options.reach);
  return combine::moved(combine::scaled(combine::rotated(std::move(leaf), axis, degrees), factor), by);
}

inline Expression node(detail::Random& random, const std::vector<Expression>& leaves, int depth,
                       const RandomExpressionOptions& options) {
  if (depth == 0 || random.unit() < 0.2) return placed(random, leaves, options);
  const std::uint64_t choice = random.next() % (options.isBooleanOnly ? 4 : 8);
  const double length = options.length * (0.2 + 0.8 * random.unit());
  Expression one = node(random, leaves, depth - 1, options);
  if (choice == 6) return combine::offset(std::move(one), length);
  if (choice == 7) return combine::shell(std::move(one), length, static_cast<ShellSide>(random.next() % 3));
  Expression other = node(random, leaves, depth - 1, options);
  switch (choice) {
    case 0:
    case 1:
      return combine::unite(std::move(one), std::move(other));
    case 2:
      return combine::intersect(std::move(one), std::move(other));
    case 3:
      return combine::subtract(std::move(one), std::move(other));
    case 4:
      return combine::smoothUnite(length, {std::move(one), std::move(other)});
    default:
      return combine::smoothSubtract(length, {std::move(one), std::move(other)});
  }
}

}  // namespace random_expression

/// Returns a random expression of the leaves, which should be about as large as the cube [-1, 1]³. Nothing may be left
/// of it, so that `CombinedDistance` refuses it.
inline Expression randomExpression(std::uint64_t seed, const std::vector<Expression>& leaves,
                                   const RandomExpressionOptions& options = {}) {
  detail::Random random(seed, 0);
  return random_expression::node(random, leaves, options.depth, options);
}

}  // namespace hpsdf
