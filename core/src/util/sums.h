#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace hpsdf {

/// Sums and the greatest of some values, none below 0. Those of chunks are to be added up in their order.
struct Sums {
  std::size_t count = 0;
  double sum = 0, squares = 0, max = 0;

  void add(double x) {
    ++count;
    sum += x;
    squares += x * x;
    max = std::max(max, x);
  }
  void add(const Sums& other) {
    count += other.count;
    sum += other.sum;
    squares += other.squares;
    max = std::max(max, other.max);
  }
  /// 0 without any.
  double mean() const { return count == 0 ? 0 : sum / static_cast<double>(count); }
  double rms() const { return count == 0 ? 0 : std::sqrt(squares / static_cast<double>(count)); }
};

}  // namespace hpsdf
