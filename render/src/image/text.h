#pragma once
// Anti-aliased text in the built-in font (DejaVu Sans). Strings are UTF-8; a size is the em in pixels; the position of
// a text is the left end of its baseline.

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
  double advance = 0;  ///< distance in pixels to the start of a text that follows
  PixelRect ink;       ///< contains every pixel that drawing may change
};

TextMeasure measureText(std::string_view text, double size, double x = 0, double baseline = 0);

/// The advance of `measureText`.
inline double advanceOf(std::string_view text, double size) { return measureText(text, size).advance; }

/// Height in pixels of capitals and digits above the baseline, by which text is centred vertically.
double capHeight(double size);

/// Skips pixels outside of the image.
void drawText(Image& image, std::string_view text, double size, double x, double baseline, Color color);

/// The text if it is at most `width` pixels wide; else the longest beginning that fits with an ellipsis; empty if not
/// even the ellipsis fits.
std::string fitText(std::string_view text, double size, double width);

}  // namespace hpsdf::render
