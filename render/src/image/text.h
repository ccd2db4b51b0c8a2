#pragma once
// Anti-aliased text in the built-in font (DejaVu Sans). Strings are UTF-8; a size is the em in pixels; the position of
// a text is the left end of its baseline.

#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/render/image.h"
#include "image/pixel_rect.h"

namespace hpsdf::render {

struct TextMeasure {
  double advance = 0;  ///< distance in pixels to the start of the next text on the line
  PixelRect ink;       ///< rectangle of all pixels that drawing the text may change
};

TextMeasure measureText(std::string_view text, double size, double x = 0, double baseline = 0);

/// The advance width of a text in pixels, as `measureText` returns it.
inline double advanceOf(std::string_view text, double size) { return measureText(text, size).advance; }

/// Height in pixels of capitals and digits above the baseline. It serves to centre text vertically.
double capHeight(double size);

/// A letter of a text, with its place on the baseline.
struct Glyph {
  int index = 0;     ///< number of the glyph in the font
  double x = 0;      ///< distance from the beginning of the text, pixels
  std::string text;  ///< the letter in UTF-8; U+FFFD for bytes that are no UTF-8 and for control characters
};

/// Returns the letters of a text in the places where `drawText` draws them.
std::vector<Glyph> glyphsOf(std::string_view text, double size);

/// Draws a text into an image. Leaves out pixels outside of the image.
void drawText(Image& image, std::string_view text, double size, double x, double baseline, Color color);

/// Returns the text if it is at most `width` pixels wide. Else returns the longest beginning of the text that
/// fits together with an ellipsis, or an empty text if not even the ellipsis fits.
std::string fitText(std::string_view text, double size, double width);

/// Returns the text that `printf` would print, cut to at most 63 characters.
template <typename... Arguments>
std::string printed(const char* format, Arguments... arguments) {
  char text[64];
  std::snprintf(text, sizeof text, format, arguments...);
  return text;
}

}  // namespace hpsdf::render
