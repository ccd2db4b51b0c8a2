#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf::detail {

/// Returns the order of points along a Morton curve through a box, which should hold them. Successive points are close
/// to each other. Points of one cell of the curve keep their order.
std::vector<std::uint32_t> mortonOrder(std::span<const Vector3> points, const Box& box);

}  // namespace hpsdf::detail
