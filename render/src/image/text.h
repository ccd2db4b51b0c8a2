#pragma once
// Anti-aliased text in the built-in font (DejaVu Sans). Strings are UTF-8; sizes are pixels an em; a text stands at the
// left end of its baseline.

#include <string>
#include <string_view>

#include "hpsdf/render/image.h"

namespace hpsdf::render {

/// Half-open rectangle of pixels.
struct PixelRect {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  int width() const { return x1 - x0; }
  int height() const { return y1 - y0; }
  bool empty() const { return x1 <= x0 || y1 <= y0; }
  bool contains(const PixelRect& r) const { return r.x0 >= x0 && r.y0 >= y0 && r.x1 <= x1 && r.y1 <= y1; }
  bool overlaps(const PixelRect& r) const { return x0 < r.x1 && r.x0 < x1 && y0 < r.y1 && r.y0 < y1; }
  bool operator==(const PixelRect&) const = default;
};

struct TextMeasure {
  double advance = 0;  ///< to where the next text would stand
  PixelRect ink;       ///< every pixel that drawing may change
};

TextMeasure measureText(std::string_view text, double size, double x = 0, double baseline = 0);

/// Height of capitals and digits above the baseline: what to centre on.
double capHeight(double size);

/// Pixels outside of the image are left out.
void drawText(Image& image, std::string_view text, double size, double x, double baseline, Color color);

/// The text itself, or as much of its beginning as fits into `width` pixels with an ellipsis; empty if not even that
/// fits.
std::string fitText(std::string_view text, double size, double width);

}  // namespace hpsdf::render
