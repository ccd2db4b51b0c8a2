#include "files/svg_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>
#include <string_view>
#include <utility>

#include "hpsdf/render/vector_picture.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

// The layout of a chart, in pixels.
constexpr int kChartWidth = 960, kChartHeight = 440;
constexpr double kPlotLeft = 76, kPlotTop = 12, kPlotRight = 700, kPlotBottom = 384;
constexpr double kLegendLeft = 724, kLegendLine = 20;
constexpr std::size_t kLegendLetters = 30;
constexpr render::Color kChartInk = {28, 32, 36};

/// A logarithmic axis from `low` to `high`, drawn between the pixels `from` and `to`.
struct LogAxis {
  double low, high, from, to;

  double at(double value) const { return from + (to - from) * std::log(value / low) / std::log(high / low); }
};

/// Returns an axis that holds all positive coordinates of the curves, with a little space at both ends.
LogAxis axisFor(const Chart& chart, int coordinate, double from, double to) {
  double low = std::numeric_limits<double>::infinity(), high = 0;
  for (const ChartCurve& curve : chart.curves)
    for (const auto& point : curve.points) {
      if (!(point[0] > 0 && point[1] > 0)) continue;
      low = std::min(low, point[coordinate]);
      high = std::max(high, point[coordinate]);
    }
  if (high == 0) low = high = 1;  // there is nothing to draw
  const double space = std::max(std::pow(high / low, 0.04), 1.1);
  return {low / space, high * space, from, to};
}

/// Returns the values at which an axis has ticks: the powers of ten, and their multiples by 2 and 5 where there is
/// room.
std::vector<double> ticksOf(const LogAxis& axis) {
  const double decades = std::log10(axis.high / axis.low);
  const int step = std::max(1, int(decades / 9));
  std::vector<double> ticks;
  for (int power = int(std::floor(std::log10(axis.low))); power <= int(std::ceil(std::log10(axis.high))); ++power)
    for (const int factor : {1, 2, 5}) {
      const double tick = factor * std::pow(10, power);
      const bool isShown = factor == 1 ? power % step == 0 : decades < 2.5;
      if (isShown && tick >= axis.low && tick <= axis.high) ticks.push_back(tick);
    }
  return ticks;
}

/// Returns a legend's text, cut off if it is too long. It is cut between characters of UTF-8, not within one.
std::string legendText(const std::string& name) {
  if (name.size() <= kLegendLetters) return name;
  std::size_t end = kLegendLetters - 1;
  while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xc0) == 0x80) --end;
  return name.substr(0, end) + "…";
}

/// Returns a whole number in superscript digits.
std::string superscript(int number) {
  constexpr std::array kDigits = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = number < 0 ? "⁻" : "";
  for (const char digit : std::to_string(std::abs(number))) text += kDigits[std::size_t(digit - '0')];
  return text;
}

/// Returns the text of a tick: 0.01, 5, 10⁻⁶.
std::string tickText(double tick) {
  const int power = int(std::floor(std::log10(tick) + 1e-9));
  const long factor = std::lround(tick / std::pow(10, power));
  if (power >= -2 && power <= 3) return fmt::format("{:.6g}", tick);
  return fmt::format("{}10{}", factor == 1 ? "" : fmt::format("{}·", factor), superscript(power));
}

/// Returns the colour "#rrggbb".
render::Color colorOf(const std::string& text) {
  const auto bits = static_cast<std::uint32_t>(std::stoul(text.substr(1), nullptr, 16));
  return {std::uint8_t(bits >> 16), std::uint8_t(bits >> 8 & 0xff), std::uint8_t(bits & 0xff)};
}

/// Draws a chart as shapes.
class ChartDrawing {
 public:
  explicit ChartDrawing(const Chart& chart)
      : chart_(chart), x_(axisFor(chart, 0, kPlotLeft, kPlotRight)), y_(axisFor(chart, 1, kPlotBottom, kPlotTop)) {}

  render::VectorPicture picture() {
    addAxes();
    for (const ChartCurve& curve : chart_.curves) addCurve(curve);
    addLegend();
    render::VectorPicture result{kChartWidth, kChartHeight};
    result.layers.push_back(std::move(layer_));
    return result;
  }

 private:
  static constexpr double kTextSize = 12;

  void line(double x0, double y0, double x1, double y1, render::Color color, double width, double opacity,
            std::vector<double> dashes = {}) {
    layer_.shapes.emplace_back(render::StrokedShape{.lines = {{{x0, y0}, {x1, y1}}},
                                                    .width = width,
                                                    .color = color,
                                                    .opacity = opacity,
                                                    .dashes = std::move(dashes)});
  }

  void text(double x, double y, render::TextAnchor anchor, const std::string& shown, double rotation = 0,
            const std::string& title = {}) {
    layer_.shapes.emplace_back(render::TextShape{shown, kTextSize, {x, y}, kChartInk, anchor, rotation, title});
  }

  void addAxes() {
    using enum render::TextAnchor;
    constexpr double kGridOpacity = 0.16, kFrameOpacity = 0.6;
    for (const double tick : ticksOf(x_)) {
      line(x_.at(tick), kPlotTop, x_.at(tick), kPlotBottom, kChartInk, 1, kGridOpacity);
      text(x_.at(tick), kPlotBottom + 20, middle, tickText(tick));
    }
    for (const double tick : ticksOf(y_)) {
      line(kPlotLeft, y_.at(tick), kPlotRight, y_.at(tick), kChartInk, 1, kGridOpacity);
      text(kPlotLeft - 8, y_.at(tick) + 4, end, tickText(tick));
    }
    layer_.shapes.emplace_back(render::StrokedShape{{{{kPlotLeft, kPlotTop},
                                                      {kPlotRight, kPlotTop},
                                                      {kPlotRight, kPlotBottom},
                                                      {kPlotLeft, kPlotBottom},
                                                      {kPlotLeft, kPlotTop}}},
                                                    1,
                                                    kChartInk,
                                                    kFrameOpacity});
    text((kPlotLeft + kPlotRight) / 2, kPlotBottom + 46, middle, chart_.xLabel);
    text(16, (kPlotTop + kPlotBottom) / 2, middle, chart_.yLabel, 90);
  }

  void addCurve(const ChartCurve& curve) {
    const render::Color color = colorOf(curve.color);
    render::StrokedShape drawn{.lines = {{}}, .width = 2, .color = color};
    if (curve.dashed) {
      drawn.opacity = 0.8;
      drawn.dashes = dashes_;
    }
    std::vector<render::VectorShape> marks;
    for (const auto& [px, py] : curve.points) {
      if (!(px > 0 && py > 0)) continue;
      const Eigen::Vector2d at(x_.at(px), y_.at(py));
      drawn.lines[0].push_back(at);
      marks.emplace_back(
          render::StrokedShape{.lines = {{at}},
                               .width = 5.2,
                               .color = color,
                               .round = true,
                               .title = fmt::format("{}: {}, {}", curve.name, shortNumber(px), shortNumber(py))});
    }
    if (marks.empty()) return;
    layer_.shapes.emplace_back(std::move(drawn));
    layer_.shapes.insert(layer_.shapes.end(), marks.begin(), marks.end());
  }

  void addLegend() {
    double y = kPlotTop + 12;
    const auto entry = [&](const std::string& name, render::Color color, bool dashed) {
      line(kLegendLeft, y - 4, kLegendLeft + 26, y - 4, color, 2.5, 1, dashed ? dashes_ : std::vector<double>());
      const std::string shown = legendText(name);
      text(kLegendLeft + 34, y, render::TextAnchor::start, shown, 0, shown == name ? "" : name);
      y += kLegendLine;
    };
    std::set<std::string> named;
    for (const ChartCurve& curve : chart_.curves)
      if (named.insert(curve.name).second) entry(curve.name, colorOf(curve.color), false);
    y += kLegendLine / 2;
    if (!chart_.solid.empty()) entry(chart_.solid, kChartInk, false);
    if (!chart_.dashed.empty()) entry(chart_.dashed, kChartInk, true);
  }

  const std::vector<double> dashes_ = {6, 4};
  const Chart& chart_;
  LogAxis x_, y_;
  render::VectorLayer layer_;
};

}  // namespace

std::vector<std::string> writeChart(OutputFolder& folder, const std::string& name, const Chart& chart) {
  const render::VectorPicture picture = ChartDrawing(chart).picture();
  std::vector<std::string> files = {name + ".svg"};
  folder.write(files.back(), svgBytes(picture));
  if (!render::writesPdf()) return files;
  files.push_back(name + ".pdf");
  folder.write(files.back(), pdfBytes(picture));
  return files;
}

std::string chartSvg(const Chart& chart) {
  const std::string svg = svgBytes(ChartDrawing(chart).picture(), kChartInk);
  constexpr std::string_view kTag = "<svg";
  return std::string(kTag) + " class=\"chart\"" + svg.substr(kTag.size());
}

std::span<const std::string> curveColors() {
  static const std::vector<std::string> colors = {"#5198bd", "#bc6101", "#832f98", "#e7b91e", "#6b6b6e", "#9aa788"};
  return colors;
}

std::string curveColor(std::size_t index) { return curveColors()[index % curveColors().size()]; }

}  // namespace hpsdf::app
