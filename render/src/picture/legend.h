#pragma once
// What stands around a view: legend or colour bar to its right, caption below. Laid out first, as rectangles and texts,
// so that tests can see that nothing is clipped and nothing overlaps; then painted.

#include <map>
#include <optional>
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
constexpr double kSmallestText = 8;  ///< pixels an em: below, digits of DejaVu Sans run together

/// Dark or light, whichever reads better on it.
Color inkOn(const LinearColor& ground);

/// Where the parts of a picture stand; depends on its size alone.
struct Frame {
  int width = 0, height = 0;
  double textSize = 0;  ///< pixels an em
  bool roomy = false;   ///< room for the shares as bars and for subtitles
  PixelRect view;
  PixelRect panel;    ///< empty where the picture is too small for a legend
  PixelRect caption;  ///< empty where it is too small for a caption
};

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

/// Painted in this order.
struct Overlay {
  std::vector<BoxItem> boxes;
  std::vector<TextItem> texts;
};

/// The first title that fits into a width, or as much as fits of the last.
std::string fittingTitle(std::span<const std::string> titles, double size, double width);

/// One swatch a level, the highest on top, with the level's number and its share of the volume. The first of `titles`
/// that fits is taken.
void addLevelLegend(Overlay& overlay, const Frame& frame, std::span<const std::string> titles,
                    const std::map<int, double>& shares, const LevelMap& map);

/// A vertical colour bar with the iso-lines of the picture and their values.
void addDistanceBar(Overlay& overlay, const Frame& frame, const DistanceScale& scale);

/// A vertical colour bar of a quantity's scale, its high end on top, with marks at powers of ten or at even steps.
void addScaleBar(Overlay& overlay, const Frame& frame, std::span<const std::string> titles, const ColorScale& scale);

/// Which axes lie to the right and upwards: a pair of arrows left of the lower left corner of the slice's section with
/// the domain, or below it, where the view is free there, else on a plate in that corner. Nothing where the section is
/// too small for it.
void addAxes(Overlay& overlay, const Frame& frame, const PixelRect& section, char right, char up);

/// Names and values, as many as fit.
void addFacts(Overlay& overlay, const Frame& frame, std::span<const std::string> titles,
              std::span<const std::pair<std::string, std::string>> facts);

/// A colour, what it stands for and how often it is there, which may be left out.
struct Swatch {
  std::vector<std::string> names;  ///< the first that fits is taken
  std::string count;
  Color color;
};

/// A row each, as many as fit.
void addSwatches(Overlay& overlay, const Frame& frame, std::span<const std::string> titles,
                 std::span<const Swatch> swatches);

/// The name, then those details that fit, the most important ones first.
void addCaption(Overlay& overlay, const Frame& frame, const std::string& name, std::span<const std::string> details);

void paint(Image& image, const Overlay& overlay);

/// "−0.25", "15200", "1.5e-7": a true minus sign; plain up to 6 digits before the point, the exponent as one types it.
std::string formatNumber(double value, int digits = 4);
/// "54,935".
std::string formatCount(std::size_t count);
/// "63.9 %", "<0.1 %".
std::string formatShare(double fraction);

}  // namespace hpsdf::render
