#pragma once
// The frame around a view: a panel with the legend or colour bar to the right of the view, and a caption below.
// It is laid out as rectangles and texts before it is painted, so that tests can check that nothing is clipped
// or overlaps.

#include <algorithm>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "image/colormap.h"
#include "image/text.h"

namespace hpsdf::render {

constexpr Color kInk = {32, 34, 44};
constexpr Color kSoftInk = {98, 102, 116};
constexpr Color kRule = {222, 223, 228};
constexpr Color kTick = {60, 64, 78};
constexpr double kSmallestText = 8;  ///< em in pixels; digits of DejaVu Sans run together in smaller text

/// The text colour, dark or light, that is more legible on a background of the colour `ground`.
Color inkOn(const LinearColor& ground);

/// The layout of a picture in pixels: the rectangles of the view, the panel and the caption.
struct Frame {
  int width = 0, height = 0;
  double textSize = 0;  ///< em in pixels
  bool roomy = false;   ///< the panel has room for bars of shares and for subtitles
  PixelRect view;
  PixelRect panel;    ///< empty where the picture is too small for a legend
  PixelRect caption;  ///< empty where the picture is too small for a caption

  /// Width of thin lines, pixels.
  double lineWidth() const { return std::max(0.7, textSize / 15); }
};

/// The layout of a picture of width × height pixels.
Frame frame(int width, int height);

struct BoxItem {
  double x0, y0, x1, y1;  ///< pixels, edges anti-aliased
  Color color;
};

struct TextItem {
  std::string text;
  double size, x, baseline;
  Color color;
};

/// Boxes and texts that are drawn over the coloured view. The texts are painted over the boxes.
struct Overlay {
  std::vector<BoxItem> boxes;
  std::vector<TextItem> texts;
};

/// Adds a text that is not empty, with the left end of its baseline at (x, baseline).
void addText(Overlay& overlay, std::string text, double size, double x, double baseline, Color color);

/// Returns the first of the titles that is at most `width` pixels wide. If none is, returns the beginning of
/// the last title.
std::string fittingTitle(std::span<const std::string> titles, double size, double width);

/// Adds a swatch for each level (degree or depth), the highest level on top, with the level's number and its
/// share of the volume. In this and the functions below, the first of `titles` that fits is the title of the
/// panel.
void addLevelLegend(Overlay& overlay, const Frame& frame, std::span<const std::string> titles,
                    const std::map<int, double>& shares, const LevelMap& map);

/// Adds a vertical colour bar for distances. It shows the iso-lines of the picture and their values.
void addDistanceBar(Overlay& overlay, const Frame& frame, const DistanceScale& scale);

/// Adds a vertical colour bar for the scale of a quantity. The high end is on top. Marks are at powers of ten
/// or at even steps.
void addScaleBar(Overlay& overlay, const Frame& frame, std::span<const std::string> titles, const ColorScale& scale);

/// Adds two arrows that name the axes which point to the right and up. They lie to the left of the section's
/// lower left corner or below it if the view is empty there, else on a plate in that corner. If the section is
/// too small, no arrows are added.
void addAxes(Overlay& overlay, const Frame& frame, const PixelRect& section, char right, char up);

/// Adds rows for facts, each a name and a value, to the panel, as many as fit.
void addFacts(Overlay& overlay, const Frame& frame, std::span<const std::string> titles,
              std::span<const std::pair<std::string, std::string>> facts);

/// A row of a legend: a colour with its meaning, and a count, which may be empty.
struct Swatch {
  std::vector<std::string> names;  ///< the longest first; the panel shows the first that fits
  std::string count;
  Color color;
};

/// Adds a row for each swatch to the panel, as many as fit.
void addSwatches(Overlay& overlay, const Frame& frame, std::span<const std::string> titles,
                 std::span<const Swatch> swatches);

/// Adds the caption below the view: the name, then as many of the details as fit. The details are sorted, the
/// most important first.
void addCaption(Overlay& overlay, const Frame& frame, const std::string& name, std::span<const std::string> details);

void paint(Image& image, const Overlay& overlay);

/// A number as text, as in "−0.25", "15200", "1.5e-7". The minus sign is U+2212. Numbers with up to 6 digits
/// before the point have no exponent.
std::string formatNumber(double value, int digits = 4);
/// A count as text, with commas, as in "54,935".
std::string formatCount(std::size_t count);
/// A share as text, in percent, as in "63.9 %" or "<0.1 %".
std::string formatShare(double fraction);

}  // namespace hpsdf::render
