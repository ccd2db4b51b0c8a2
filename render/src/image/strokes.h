#pragma once
// The pixels of anti-aliased strokes: curves, arrows, marks and the edges of cells.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "image/pixel_rect.h"

namespace hpsdf::render {

/// The pixels of `rect` that may be at most `reach` away from a segment.
inline PixelRect pixelsNear(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double reach,
                            const PixelRect& rect) {
  const Eigen::Vector2d low = from.cwiseMin(to).array() - reach, high = from.cwiseMax(to).array() + reach;
  const auto clamped = [](double x, int first, int end) { return int(std::clamp(x, double(first), double(end))); };
  return {clamped(std::floor(low.x()), rect.x0, rect.x1), clamped(std::floor(low.y()), rect.y0, rect.y1),
          clamped(std::ceil(high.x()), rect.x0, rect.x1), clamped(std::ceil(high.y()), rect.y0, rect.y1)};
}

struct NearPixel {
  int x, y;
  Eigen::Vector2d middle;
  double t;         ///< parameter of the segment's nearest point: 0 at its beginning, 1 at its end
  double distance;  ///< distance of the pixel's middle from the segment, below the reach
};

/// Calls f(pixel) for each pixel of `rect` whose middle is less than `reach` away from a segment.
template <typename F>
void forEachPixelNear(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double reach, const PixelRect& rect,
                      const F& f) {
  const PixelRect bounds = pixelsNear(from, to, reach, rect);
  const Eigen::Vector2d along = to - from;
  const double squared = along.squaredNorm(), length = std::sqrt(squared);
  for (int y = bounds.y0; y < bounds.y1; ++y) {
    double left = bounds.x0, right = bounds.x1;
    // Restrict the pixel row to the band of half-width `reach` around the infinite line through the segment.
    if (std::abs(along.y()) > 1e-6 * length) {
      const double x = from.x() + (y + 0.5 - from.y()) / along.y() * along.x();
      const double half = reach * length / std::abs(along.y());
      left = std::clamp(std::floor(x - half), left, right);
      right = std::clamp(std::ceil(x + half), left, right);
    }
    for (int x = int(left); x < int(right); ++x) {
      const Eigen::Vector2d middle(x + 0.5, y + 0.5);
      const double t = squared > 0 ? std::clamp((middle - from).dot(along) / squared, 0.0, 1.0) : 0.0;
      const double toSegment = (middle - from - t * along).squaredNorm();
      if (toSegment < reach * reach) f(NearPixel{x, y, middle, t, std::sqrt(toSegment)});
    }
  }
}

}  // namespace hpsdf::render
