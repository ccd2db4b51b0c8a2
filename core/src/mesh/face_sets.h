#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace hpsdf {

/// Disjoint sets of faces, or of whatever is numbered (union-find with path halving); each alone at first.
class FaceSets {
 public:
  explicit FaceSets(std::size_t faces) : parent_(faces), sets_(faces) {
    std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
  }

  void join(std::uint32_t a, std::uint32_t b) {
    a = first(a);
    b = first(b);
    if (a == b) return;
    parent_[std::max(a, b)] = std::min(a, b);
    --sets_;
  }

  std::size_t count() const { return sets_; }

  /// The lowest of the set that a face is in.
  std::uint32_t first(std::uint32_t face) {
    while (parent_[face] != face) face = parent_[face] = parent_[parent_[face]];
    return face;
  }

 private:
  std::vector<std::uint32_t> parent_;
  std::size_t sets_;
};

}  // namespace hpsdf
