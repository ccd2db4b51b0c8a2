#pragma once

#include <algorithm>
#include <string>

#include "hpsdf/error.h"

namespace hpsdf::render {

/// Throws `Error` for a width or height below 1 or above 2^20 pixels.
inline void checkViewSize(int width, int height) {
  constexpr int kLargest = 1 << 20;
  if (std::min(width, height) < 1 || std::max(width, height) > kLargest)
    throw Error("a view of " + std::to_string(width) + "x" + std::to_string(height) +
                " pixels is out of range: give 1 to 2^20 pixels a side");
}

}  // namespace hpsdf::render
