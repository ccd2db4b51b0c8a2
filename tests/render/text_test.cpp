#include "image/text.h"

#include <gtest/gtest.h>

#include <set>

namespace hpsdf::render {
namespace text_test {

constexpr Color kPaper = {255, 255, 255};
constexpr Color kInk = {0, 0, 0};

// Returns the smallest rectangle that contains all pixels that are not blank paper.
PixelRect inkOf(const Image& image) {
  PixelRect ink = {image.width, image.height, 0, 0};
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      if (image.at(x, y) == kPaper) continue;
      ink = {std::min(ink.x0, x), std::min(ink.y0, y), std::max(ink.x1, x + 1), std::max(ink.y1, y + 1)};
    }
  return ink;
}

Image drawn(std::string_view text, double size, double x = 20, double baseline = 60) {
  Image image(900, 100, kPaper);
  drawText(image, text, size, x, baseline, kInk);
  return image;
}

const char* const kSamples[] = {
    "degree · slice z = 0 · 54,935 cells · τ = 1e-6", "−0.25 °", "ε ≤ τ", "jÄgy|Å", "AVATAR To", "…", "fi", "łódź.obj"};

TEST(Text, hasNoInkOutsideOfItsMeasure) {
  for (const char* text : kSamples)
    for (double size : {8.0, 13.3, 15.0, 27.5})
      for (double x : {20.0, 20.37, 20.5, 20.99}) {
        const TextMeasure measure = measureText(text, size, x, 60);
        const PixelRect ink = inkOf(drawn(text, size, x));
        ASSERT_FALSE(ink.empty()) << text;
        EXPECT_TRUE(measure.ink.contains(ink)) << text << " at size " << size << ", x " << x;
        // The measured box must not be much larger than the ink.
        EXPECT_LE(measure.ink.width() - ink.width(), 2) << text << " at size " << size;
        EXPECT_LE(measure.ink.height() - ink.height(), 2) << text << " at size " << size;
        EXPECT_NEAR(measure.advance, ink.x1 - x, 0.25 * size + 2) << text;
      }
}

TEST(Text, advancesInProportionToItsSize) {
  for (const char* text : kSamples)
    EXPECT_NEAR(measureText(text, 30).advance, 2 * measureText(text, 15).advance, 1e-3) << text;
  EXPECT_EQ(measureText("", 15).advance, 0);
  EXPECT_TRUE(measureText("", 15).ink.empty());
}

TEST(Font, hasTheSignsThatCaptionsUse) {
  const Image missing = drawn("\uE123", 20);  // a private-use character without a glyph
  std::set<std::vector<Color>> shapes = {missing.pixels};
  for (const char* sign : {"τ", "ε", "°", "·", "−", "–", "…", "×"})
    EXPECT_TRUE(shapes.insert(drawn(sign, 20).pixels).second) << sign;
}

TEST(CapHeight, isTheHeightOfCapitals) {
  const PixelRect ink = inkOf(drawn("H", 40));
  EXPECT_EQ(ink.y1, 60);
  EXPECT_NEAR(ink.height(), capHeight(40), 1);
}

TEST(Text, isAntiAliasedAndReachesItsColor) {
  const Image image = drawn("Hx/", 40);
  std::set<int> greys;
  for (const Color& pixel : image.pixels) greys.insert(pixel[0]);
  EXPECT_TRUE(greys.contains(0));
  EXPECT_GT(greys.size(), 20U);
}

TEST(Text, isClippedAtTheImagesEdges) {
  Image image(30, 12, kPaper);
  for (double x : {-20.0, 25.0, 400.0})
    for (double baseline : {-3.0, 5.0, 14.0, 300.0}) drawText(image, "gÅ cut", 15, x, baseline, kInk);
  EXPECT_NE(inkOf(image).x1, 0);
}

TEST(Text, drawsBrokenUtf8AsReplacementSigns) {
  const Image replacement = drawn("a\uFFFDb", 20);
  for (std::string_view broken : {"a\x80"
                                  "b",
                                  "a\xff"
                                  "b",
                                  "a\xc3"
                                  "b",
                                  "a\nb"})
    EXPECT_EQ(drawn(broken, 20).pixels, replacement.pixels);
  // Two bytes for a letter that takes one, half of a UTF-16 pair, a code point that XML excludes, one beyond the last.
  for (std::string_view noCharacter : {"\xc1\xa1", "\xed\xa0\x80", "\xef\xbf\xbf", "\xf4\x90\x80\x80"})
    EXPECT_EQ(drawn("a" + std::string(noCharacter) + "b", 20).pixels, replacement.pixels);
  EXPECT_EQ(drawn("a\xe2\x82", 20).pixels, drawn("a\uFFFD\uFFFD", 20).pixels);
}

TEST(Text, fitsWithAnEllipsisAfterAWholeCharacter) {
  const std::string name = "ßéτ−ßéτ−ßéτ−ßéτ−ßéτ−.obj";
  EXPECT_EQ(fitText(name, 15, 1000), name);
  std::size_t longest = 0;
  for (double width = 0; width < measureText(name, 15).advance; width += 1.7) {
    const std::string fitted = fitText(name, 15, width);
    EXPECT_LE(measureText(fitted, 15).advance, width);
    if (fitted.empty()) continue;
    const std::string beginning = fitted.substr(0, fitted.size() - std::string("…").size());
    EXPECT_EQ(fitted, beginning + "…");
    EXPECT_EQ(name.substr(0, beginning.size()), beginning);
    const bool betweenCharacters = (static_cast<unsigned char>(name[beginning.size()]) & 0xc0) != 0x80;
    EXPECT_TRUE(betweenCharacters) << fitted;
    EXPECT_GE(fitted.size(), longest);
    longest = fitted.size();
  }
  EXPECT_GT(longest, name.size() / 2);
  EXPECT_EQ(fitText(name, 15, 3), "");
}

}  // namespace text_test
}  // namespace hpsdf::render
