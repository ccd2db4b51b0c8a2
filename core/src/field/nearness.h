#pragma once

#include <algorithm>
#include <cmath>

#include "hpsdf/field.h"

namespace hpsdf {

/// κ of a cell with this mean distance: c_000 of its own fit, the other polynomials having none (paper, eq. 10).
inline double nearnessWeight(NearnessKind kind, double nearness, double mean, double diagonal) {
  const double share = std::abs(mean) / diagonal;
  return kind == NearnessKind::exponential ? std::exp(-nearness * share)
                                           : std::pow(std::clamp(1 - share, 0.0, 1.0), nearness);
}

}  // namespace hpsdf
