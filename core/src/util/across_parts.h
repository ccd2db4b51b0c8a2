#pragma once
// Sums and maxima over the parts of a field that several processes hold.

#include <functional>

#include "util/exact_sum.h"

namespace hpsdf::detail {

/// Makes sums and maxima over a part those over all parts. All processes call the functions in the same order. For a
/// field that one process holds, as by default, the numbers stay as they are.
struct AcrossParts {
  std::function<void(ExactSum&)> add = [](ExactSum&) {};
  std::function<double(double)> greatest = [](double own) { return own; };

  bool all(bool own) const { return greatest(own ? 0 : 1) == 0; }
};

}  // namespace hpsdf::detail
