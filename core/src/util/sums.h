#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace hpsdf::detail {

/// Count, sum, sum of squares and maximum of non-negative values. Add the sums of chunks in the chunks' order, so that
/// the rounding does not depend on the number of threads.
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

  // Mean and root mean square are 0 without any value.
  double mean() const { return count == 0 ? 0 : sum / static_cast<double>(count); }
  double rms() const { return count == 0 ? 0 : std::sqrt(squares / static_cast<double>(count)); }
};

}  // namespace hpsdf::detail
