#pragma once

namespace hpsdf::render {

/// A rectangle of pixels, half-open: x0 ≤ x < x1, y0 ≤ y < y1.
struct PixelRect {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  int width() const { return x1 - x0; }
  int height() const { return y1 - y0; }
  bool empty() const { return x1 <= x0 || y1 <= y0; }
  bool contains(const PixelRect& r) const { return r.x0 >= x0 && r.y0 >= y0 && r.x1 <= x1 && r.y1 <= y1; }
  bool overlaps(const PixelRect& r) const { return x0 < r.x1 && r.x0 < x1 && y0 < r.y1 && r.y0 < y1; }
  bool operator==(const PixelRect&) const = default;
};

}  // namespace hpsdf::render
