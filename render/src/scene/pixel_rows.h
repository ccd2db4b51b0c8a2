#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/render/view.h"
#include "image/pixel_rect.h"

namespace hpsdf::render {

/// The pixels of a view whose centres may lie in the convex hull of the points. Returns no pixels if all points have
/// depths below `leastDepth`. Returns the whole view if only some of the points have such depths, because the hull
/// then extends behind the eye.
inline PixelRect pixelsAround(std::span<const PicturePoint> points, double leastDepth, int width, int height) {
  constexpr double kMargin = 1e-6;  // margin for rounding errors, pixels
  Eigen::AlignedBox2d hull;
  std::size_t behind = 0;
  for (const PicturePoint& p : points) {
    if (p.depth >= leastDepth)
      hull.extend(Eigen::Vector2d(p.x, p.y));
    else
      ++behind;
  }
  if (behind == points.size()) return {};
  if (behind > 0) return {0, 0, width, height};
  const auto clamped = [](double pixel, int pixels) { return int(std::clamp(pixel, 0.0, double(pixels))); };
  return {clamped(std::ceil(hull.min().x() - 0.5 - kMargin), width),
          clamped(std::ceil(hull.min().y() - 0.5 - kMargin), height),
          clamped(std::floor(hull.max().x() + 0.5 + kMargin), width),
          clamped(std::floor(hull.max().y() + 0.5 + kMargin), height)};
}

/// Draws objects in parallel, in strips of 16 pixel rows. Calls fill(y0, y1, indices) for the strip of rows y0 to
/// y1 − 1, where `indices` are the ascending indices of the objects whose rectangles in `rects` meet the strip. The
/// result does not depend on the number of threads if `fill` changes only the rows of its strip.
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
