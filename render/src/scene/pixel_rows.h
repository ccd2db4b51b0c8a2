#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "image/pixel_rect.h"

namespace hpsdf::render {

/// Draws things with known rectangles in parallel: calls fill(y0, y1, indices) for strips of 16 rows, where `indices`
/// are those of the rectangles that meet the rows, ascending. The result does not depend on the number of threads as
/// long as `fill` changes only these rows.
template <typename Fill>
void forEachStrip(int height, const std::vector<PixelRect>& rects, const Fill& fill) {
  constexpr int kRows = 16;
  std::vector<std::vector<std::uint32_t>> strips((height + kRows - 1) / kRows);
  for (std::size_t i = 0; i < rects.size(); ++i)
    if (!rects[i].empty())
      for (int strip = rects[i].y0 / kRows; strip * kRows < rects[i].y1; ++strip)
        strips[strip].push_back(static_cast<std::uint32_t>(i));
  tbb::parallel_for(std::size_t{0}, strips.size(), [&](std::size_t strip) {
    const int y0 = static_cast<int>(strip) * kRows;
    fill(y0, std::min(y0 + kRows, height), strips[strip]);
  });
}

}  // namespace hpsdf::render
