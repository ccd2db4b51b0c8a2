#pragma once
// Anti-aliased text in the built-in font (DejaVu Sans). Strings are UTF-8; a size is the em in pixels; the position of
// a text is the left end of its baseline.

#include <cstdio>
#include <string>
#include <string_view>

#include "hpsdf/render/image.h"
#include "image/pixel_rect.h"

namespace hpsdf::render {

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

/// The text that `printf` prints, of at most 63 characters.
template <typename... Arguments>
std::string printed(const char* format, Arguments... arguments) {
  char text[64];
  std::snprintf(text, sizeof text, format, arguments...);
  return text;
}

}  // namespace hpsdf::render
