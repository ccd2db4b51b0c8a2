#pragma once
// The frame around a view: a panel with the legend or colour bar to the right, and a caption below. Its rectangles and
// texts are laid out before they are painted, so that tests can check that nothing is clipped or overlaps.

#include <algorithm>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hpsdf/render/vector_picture.h"
#include "image/colormap.h"
#include "image/text.h"

namespace hpsdf::render {

constexpr Color kInk = {32, 34, 44};
constexpr Color kSoftInk = {98, 102, 116};
constexpr Color kRule = {222, 223, 228};
constexpr Color kTick = {60, 64, 78};
constexpr double kSmallestText = 8;  ///< least em in pixels; digits of DejaVu Sans run together in smaller text

/// The text colour, dark or light, that is more legible on a background of the colour `ground`.
Color inkOn(const LinearColor& ground);

/// The layout of a picture in pixels: the rectangles of the view, the panel and the caption.
struct Frame {
  int width = 0, height = 0;
  double textSize = 0;  ///< text size: the em in pixels
  bool roomy = false;   ///< whether the panel has room for subtitles and for bars that show shares
  PixelRect view;
  PixelRect panel;    ///< empty where the picture is too small for a legend
  PixelRect caption;  ///< empty where the picture is too small for a caption

  /// Width of thin lines, pixels.
  double lineWidth() const { return std::max(0.7, textSize / 15); }
};

/// The layout of a picture of width × height pixels.
Frame frame(int width, int height);

struct BoxItem {
  double x0, y0, x1, y1;  ///< corners in pixels; the edges are anti-aliased
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

/// Adds a text, unless it is empty, with the left end of its baseline at (x, baseline).
void addText(Overlay& overlay, std::string text, double size, double x, double baseline, Color color);

/// Returns the first of the titles that is at most `width` pixels wide. If all are wider, returns the beginning of the
/// last title.
std::string fittingTitle(std::span<const std::string> titles, double size, double width);

/// Adds a swatch for each level (degree or depth), the highest level on top, with the level's number and its share of
/// the volume. Here and in the functions below, the panel's title is the first of `titles` that fits.
void addLevelLegend(Overlay& overlay, const Frame& frame, std::span<const std::string> titles,
                    const std::map<int, double>& shares);

/// Adds a vertical colour bar for distances, with the iso-lines of the picture and their values.
void addDistanceBar(Overlay& overlay, const Frame& frame, const DistanceScale& scale, const ColorMap& map);

/// Adds a vertical colour bar for the scale of a quantity, with the high end on top and marks at powers of ten or at
/// even steps.
void addScaleBar(Overlay& overlay, const Frame& frame, std::span<const std::string> titles, const ColorScale& scale);

/// Adds two arrows with the names of the axes that point to the right and up. If the picture is empty beside or below
/// the section's lower left corner, the arrows lie there. Otherwise they lie within the section, on a plain rectangle
/// in this corner. A section that is too small gets no arrows.
void addAxes(Overlay& overlay, const Frame& frame, const PixelRect& section, char right, char up);

/// Adds a row to the panel for each fact, which is a name and a value, as many as fit. Returns where the free part of
/// the panel begins.
double addFacts(Overlay& overlay, const Frame& frame, std::span<const std::string> titles,
                std::span<const std::pair<std::string, std::string>> facts);

/// Adds a bar to the panel for the share of each level (degree or depth), the highest level on top, from `top` down.
/// Adds nothing if not all bars fit. Returns where the free part of the panel begins.
double addShares(Overlay& overlay, const Frame& frame, double top, const std::string& title,
                 const std::map<int, double>& shares);

/// A row of a legend: a colour with its meaning, and a count, which may be empty.
struct Swatch {
  std::vector<std::string> names;  ///< the longest first; the panel shows the first that fits
  std::string count;
  Color color;
};

/// Adds a row for each swatch to the panel, as many as fit.
void addSwatches(Overlay& overlay, const Frame& frame, std::span<const std::string> titles,
                 std::span<const Swatch> swatches);

/// The height of a swatch's row without a count, in pixels.
double swatchHeight(const Frame& frame);

/// Adds the caption below the view: the name, then as many of the details as fit. The details are sorted, the
/// most important first.
void addCaption(Overlay& overlay, const Frame& frame, const std::string& name, std::span<const std::string> details);

void paint(Image& image, const Overlay& overlay);

/// Returns the overlay of a picture that is enlarged by this factor.
Overlay enlarged(Overlay overlay, double factor);

/// Returns the overlay as shapes of a vector picture.
VectorLayer overlayLayer(const Overlay& overlay);

/// Formats a number, as in "−0.25", "15200", "1.5e-7". The minus sign is U+2212. Numbers with up to 6 digits before the
/// point have no exponent, unless they are very small.
std::string formatNumber(double value, int digits = 4);
/// Formats a count with commas, as in "54,935".
std::string formatCount(std::size_t count);
/// Formats a fraction in percent, as in "63.9 %" or "<0.1 %".
std::string formatShare(double fraction);

}  // namespace hpsdf::render
