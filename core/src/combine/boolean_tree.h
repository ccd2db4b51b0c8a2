#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace hpsdf::combine {

/// A Boolean expression of solids, which are known by their numbers.
struct BooleanTree {
  enum class Kind : std::uint8_t { solid, unite, intersect, subtract };

  Kind kind = Kind::solid;
  std::uint32_t solid = 0;                 ///< number of the solid, for a leaf
  std::vector<BooleanTree> children = {};  ///< `subtract`: the first without the others

  /// Returns whether a point is inside, given a function that tells whether it is inside the solid with a number.
  template <typename IsInside>
  bool contains(const IsInside& isInside) const {
    const auto holds = [&](const BooleanTree& child) { return child.contains(isInside); };
    switch (kind) {
      case Kind::unite:
        return std::ranges::any_of(children, holds);
      case Kind::intersect:
        return std::ranges::all_of(children, holds);
      case Kind::subtract:
        return holds(children[0]) && std::none_of(children.begin() + 1, children.end(), holds);
      default:
        return isInside(solid);
    }
  }

  /// Gives each solid the number numberOf(its number).
  template <typename NumberOf>
  void renumber(const NumberOf& numberOf) {
    if (kind == Kind::solid) solid = numberOf(solid);
    for (BooleanTree& child : children) child.renumber(numberOf);
  }
};

}  // namespace hpsdf::combine
