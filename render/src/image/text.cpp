#include "image/text.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <vector>

#include "image/embedded.h"

// Makes stb's functions static, because ImGui and others contain their own copies of stb.
#define STB_TRUETYPE_IMPLEMENTATION
#define STBTT_STATIC
#include <stb/stb_truetype.h>

namespace hpsdf::render {
namespace {

constexpr char32_t kReplacement = 0xfffd;

const stbtt_fontinfo& font() {
  static const stbtt_fontinfo info = [] {
    stbtt_fontinfo f;
    const unsigned char* data = dejavuSans().data();
    [[maybe_unused]] const int ok = stbtt_InitFont(&f, data, stbtt_GetFontOffsetForIndex(data, 0));
    assert(ok && "the built-in font is part of the library");
    return f;
  }();
  return info;
}

// Length in bytes of the UTF-8 sequence that starts with the byte `first`; 1 if no sequence starts with this
// byte.
std::size_t sequenceLength(unsigned char first) {
  if (first >= 0xf0 && first < 0xf8) return 4;
  if (first >= 0xe0) return first < 0xf0 ? 3 : 1;
  return first >= 0xc0 ? 2 : 1;
}

// Returns true if a code point that UTF-8 spells with `length` bytes is a character: spelled with as few bytes as
// possible, no half of a UTF-16 pair, and not one of the two that XML excludes.
bool isCharacter(char32_t code, std::size_t length) {
  constexpr std::array<char32_t, 4> kFirstOfLength = {0, 0x80, 0x800, 0x10000};
  const bool isSurrogate = code >= 0xd800 && code <= 0xdfff;
  return code >= kFirstOfLength[length - 1] && code <= 0x10ffff && !isSurrogate && code != 0xfffe && code != 0xffff;
}

// Removes the first code point from the text. Invalid UTF-8 and control characters become U+FFFD, because file names
// may contain any bytes.
char32_t takeCodePoint(std::string_view& text) {
  const auto first = static_cast<unsigned char>(text.front());
  const std::size_t length = sequenceLength(first);
  char32_t code = length == 1 ? first : first & (0x7f >> length);
  bool valid = first < 0x80 ? first >= 0x20 && first != 0x7f : length > 1 && length <= text.size();
  std::size_t taken = 1;
  for (; valid && taken < length; ++taken) {
    const auto next = static_cast<unsigned char>(text[taken]);
    if ((next & 0xc0) != 0x80) {
      valid = false;
      break;
    }
    code = (code << 6) | (next & 0x3f);
  }
  text.remove_prefix(taken);
  return valid && isCharacter(code, length) ? code : kReplacement;
}

// Returns a code point in UTF-8.
std::string utf8Of(char32_t code) {
  const auto byte = [](char32_t bits) { return static_cast<char>(bits); };
  const auto follower = [&](int shift) { return byte(0x80 | (code >> shift & 0x3f)); };
  if (code < 0x80) return {byte(code)};
  if (code < 0x800) return {byte(0xc0 | code >> 6), follower(0)};
  if (code < 0x10000) return {byte(0xe0 | code >> 12), follower(6), follower(0)};
  return {byte(0xf0 | code >> 18), follower(12), follower(6), follower(0)};
}

struct PlacedGlyph {
  char32_t code;
  int glyph;
  int column;      // integer part of the glyph's origin, pixels
  float fraction;  // fractional part of the glyph's origin
  PixelRect box;   // extent of the glyph's bitmap
};

struct TextLine {
  std::vector<PlacedGlyph> glyphs;
  double advance = 0;
};

float scaleFor(double size) { return stbtt_ScaleForMappingEmToPixels(&font(), static_cast<float>(size)); }

// Lays out a line of text. Baselines are rounded to whole pixel rows, which keeps horizontal strokes crisp.
// Columns are not rounded, which keeps the spacing even.
TextLine layOut(std::string_view text, double size, double x, double baseline) {
  const float scale = scaleFor(size);
  const int row = static_cast<int>(std::lround(baseline));
  TextLine line;
  int previous = 0;
  while (!text.empty()) {
    const char32_t code = takeCodePoint(text);
    const int glyph = stbtt_FindGlyphIndex(&font(), static_cast<int>(code));
    if (previous) line.advance += scale * float(stbtt_GetGlyphKernAdvance(&font(), previous, glyph));
    const double origin = x + line.advance;
    PlacedGlyph placed{code, glyph, static_cast<int>(std::floor(origin)), 0, {}};
    placed.fraction = static_cast<float>(origin - placed.column);
    PixelRect& box = placed.box;
    stbtt_GetGlyphBitmapBoxSubpixel(&font(), glyph, scale, scale, placed.fraction, 0, &box.x0, &box.y0, &box.x1,
                                    &box.y1);
    box = {box.x0 + placed.column, box.y0 + row, box.x1 + placed.column, box.y1 + row};
    line.glyphs.push_back(placed);
    int advance = 0, bearing = 0;
    stbtt_GetGlyphHMetrics(&font(), glyph, &advance, &bearing);
    line.advance += scale * float(advance);
    previous = glyph;
  }
  return line;
}

// Blends a colour into a pixel in encoded sRGB values instead of linear light, so that dark text on a light
// background keeps its weight.
void blend(Color& pixel, Color color, int coverage) {
  for (int i = 0; i < 3; ++i) {
    const int mixed = (pixel[i] * (255 - coverage) + color[i] * coverage + 127) / 255;
    pixel[i] = static_cast<std::uint8_t>(mixed);
  }
}

void drawGlyph(Image& image, const PlacedGlyph& glyph, float scale, Color color) {
  const PixelRect& box = glyph.box;
  if (box.empty()) return;
  std::vector<unsigned char> coverage(std::size_t(box.width()) * box.height());
  stbtt_MakeGlyphBitmapSubpixel(&font(), coverage.data(), box.width(), box.height(), box.width(), scale, scale,
                                glyph.fraction, 0, glyph.glyph);
  for (int y = std::max(box.y0, 0); y < std::min(box.y1, image.height); ++y)
    for (int x = std::max(box.x0, 0); x < std::min(box.x1, image.width); ++x)
      blend(image.at(x, y), color, coverage[std::size_t(y - box.y0) * box.width() + (x - box.x0)]);
}

}  // namespace

TextMeasure measureText(std::string_view text, double size, double x, double baseline) {
  const TextLine line = layOut(text, size, x, baseline);
  TextMeasure measure{line.advance, {}};
  for (const PlacedGlyph& glyph : line.glyphs) {
    if (glyph.box.empty()) continue;
    PixelRect& ink = measure.ink;
    if (ink.empty())
      ink = glyph.box;
    else
      ink = {std::min(ink.x0, glyph.box.x0), std::min(ink.y0, glyph.box.y0), std::max(ink.x1, glyph.box.x1),
             std::max(ink.y1, glyph.box.y1)};
  }
  return measure;
}

double capHeight(double size) {
  static const double unitsOfCapital = [] {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    stbtt_GetCodepointBox(&font(), 'H', &x0, &y0, &x1, &y1);
    return double(y1);
  }();
  return scaleFor(size) * unitsOfCapital;
}

std::vector<Glyph> glyphsOf(std::string_view text, double size) {
  std::vector<Glyph> glyphs;
  for (const PlacedGlyph& placed : layOut(text, size, 0, 0).glyphs)
    glyphs.push_back({placed.glyph, placed.column + double(placed.fraction), utf8Of(placed.code)});
  return glyphs;
}

void drawText(Image& image, std::string_view text, double size, double x, double baseline, Color color) {
  const float scale = scaleFor(size);
  for (const PlacedGlyph& glyph : layOut(text, size, x, baseline).glyphs) drawGlyph(image, glyph, scale, color);
}

std::string fitText(std::string_view text, double size, double width) {
  if (measureText(text, size).advance <= width) return std::string(text);
  std::vector<std::size_t> ends = {0};  // byte offset after each code point
  for (std::string_view rest = text; !rest.empty(); ends.push_back(text.size() - rest.size())) takeCodePoint(rest);
  const auto shortened = [&](std::size_t count) { return std::string(text.substr(0, ends[count])) + "…"; };
  // Find the longest part that fits by bisection, because names such as file paths may be long.
  std::size_t fits = 0, tooLong = ends.size() - 1;
  if (measureText(shortened(0), size).advance > width) return {};
  while (fits + 1 < tooLong) {
    const std::size_t middle = (fits + tooLong) / 2;
    (measureText(shortened(middle), size).advance <= width ? fits : tooLong) = middle;
  }
  return shortened(fits);
}

}  // namespace hpsdf::render
