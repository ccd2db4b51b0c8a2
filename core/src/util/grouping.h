#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hpsdf::detail {

/// Numbers sorted by the groups to which they belong, in one list.
class Grouping {
 public:
  Grouping() : first_(1) {}

  /// `forEach(visit)` calls visit(group, number) for each number of each group. It is called twice, and must visit the
  /// same numbers both times. A group keeps the order in which its numbers are visited.
  template <typename ForEach>
  Grouping(std::size_t groups, const ForEach& forEach) : first_(groups + 1) {
    forEach([&](std::size_t group, std::uint32_t) { ++first_[group + 1]; });
    for (std::size_t group = 0; group < groups; ++group) first_[group + 1] += first_[group];
    numbers_.resize(first_.back());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    forEach([&](std::size_t group, std::uint32_t number) { numbers_[next[group]++] = number; });
  }

  /// Returns the numbers of a group.
  std::span<const std::uint32_t> operator[](std::size_t group) const {
    return std::span(numbers_).subspan(first_[group], first_[group + 1] - first_[group]);
  }

  /// Returns how many numbers there are in groups before this one.
  std::uint32_t countBefore(std::size_t group) const { return first_[group]; }

  /// Returns how many numbers there are in all groups.
  std::size_t count() const { return numbers_.size(); }

 private:
  std::vector<std::uint32_t> first_;  ///< by group: the place of its first number
  std::vector<std::uint32_t> numbers_;
};

}  // namespace hpsdf::detail
