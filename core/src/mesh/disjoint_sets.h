#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace hpsdf::mesh {

/// Disjoint sets of the numbers below `elements`, by union-find with path halving. Each number starts in its own set.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t elements) : parent_(elements), sets_(elements) {
    std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
  }

  /// Unites the sets of two elements.
  void join(std::uint32_t a, std::uint32_t b) {
    a = first(a);
    b = first(b);
    if (a == b) return;
    parent_[std::max(a, b)] = std::min(a, b);
    --sets_;
  }

  /// The number of sets.
  std::size_t count() const { return sets_; }

  /// The lowest element of an element's set.
  std::uint32_t first(std::uint32_t element) {
    while (parent_[element] != element) element = parent_[element] = parent_[parent_[element]];
    return element;
  }

 private:
  std::vector<std::uint32_t> parent_;
  std::size_t sets_;
};

}  // namespace hpsdf::mesh
