#include "files/svg_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <set>

#include "files/html_page.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

// The layout of a chart, in pixels.
constexpr double kChartWidth = 960, kChartHeight = 440;
constexpr double kPlotLeft = 76, kPlotTop = 12, kPlotRight = 700, kPlotBottom = 384;
constexpr double kLegendLeft = 724, kLegendLine = 20;
constexpr std::size_t kLegendLetters = 30;

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

/// Returns a legend's text as SVG, cut off if it is too long. It is cut between characters of UTF-8, not within one.
std::string legendText(const std::string& name) {
  if (name.size() <= kLegendLetters) return htmlEscaped(name);
  std::size_t end = kLegendLetters - 1;
  while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xc0) == 0x80) --end;
  return fmt::format("{}…<title>{}</title>", htmlEscaped(name.substr(0, end)), htmlEscaped(name));
}

/// Returns the text of a tick, as SVG: 0.01, 5, 10⁻⁶.
std::string tickText(double tick) {
  const int power = int(std::floor(std::log10(tick) + 1e-9));
  const long factor = std::lround(tick / std::pow(10, power));
  if (power >= -2 && power <= 3) return fmt::format("{:.6g}", tick);
  return fmt::format("{}10<tspan dy=\"-5\" font-size=\"9\">{}</tspan>", factor == 1 ? "" : fmt::format("{}·", factor),
                     power);
}

std::string lineSvg(double x0, double y0, double x1, double y1, const char* style) {
  return fmt::format("<path d=\"M{:.2f} {:.2f}L{:.2f} {:.2f}\" {}/>\n", x0, y0, x1, y1, style);
}

std::string textSvg(double x, double y, const char* anchor, const std::string& svg) {
  return fmt::format("<text x=\"{:.2f}\" y=\"{:.2f}\" text-anchor=\"{}\" fill=\"currentColor\">{}</text>\n", x, y,
                     anchor, svg);
}

std::string axesSvg(const Chart& chart, const LogAxis& x, const LogAxis& y) {
  constexpr const char* kGrid = "stroke=\"currentColor\" stroke-opacity=\"0.16\"";
  std::string svg;
  for (const double tick : ticksOf(x)) {
    svg += lineSvg(x.at(tick), kPlotTop, x.at(tick), kPlotBottom, kGrid);
    svg += textSvg(x.at(tick), kPlotBottom + 20, "middle", tickText(tick));
  }
  for (const double tick : ticksOf(y)) {
    svg += lineSvg(kPlotLeft, y.at(tick), kPlotRight, y.at(tick), kGrid);
    svg += textSvg(kPlotLeft - 8, y.at(tick) + 4, "end", tickText(tick));
  }
  svg += fmt::format(
      "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"currentColor\" "
      "stroke-opacity=\"0.6\"/>\n",
      kPlotLeft, kPlotTop, kPlotRight - kPlotLeft, kPlotBottom - kPlotTop);
  svg += textSvg((kPlotLeft + kPlotRight) / 2, kPlotBottom + 46, "middle", htmlEscaped(chart.xLabel));
  const double middle = (kPlotTop + kPlotBottom) / 2;
  return svg + fmt::format(
                   "<text transform=\"translate(16 {:.2f}) rotate(-90)\" text-anchor=\"middle\" "
                   "fill=\"currentColor\">{}</text>\n",
                   middle, htmlEscaped(chart.yLabel));
}

std::string curveSvg(const ChartCurve& curve, const LogAxis& x, const LogAxis& y) {
  std::string line, marks;
  for (const auto& [px, py] : curve.points) {
    if (!(px > 0 && py > 0)) continue;
    line += fmt::format("{}{:.2f} {:.2f}", line.empty() ? "M" : "L", x.at(px), y.at(py));
    marks +=
        fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"2.6\" fill=\"{}\"><title>{}: {}, {}</title></circle>\n",
                    x.at(px), y.at(py), curve.color, htmlEscaped(curve.name), shortNumber(px), shortNumber(py));
  }
  return fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{}/>\n{}", line, curve.color,
                     curve.dashed ? " stroke-dasharray=\"6 4\" stroke-opacity=\"0.8\"" : "", marks);
}

std::string legendSvg(const Chart& chart) {
  std::string svg;
  double y = kPlotTop + 12;
  const auto entry = [&](const std::string& name, const std::string& color, bool dashed) {
    svg += lineSvg(
        kLegendLeft, y - 4, kLegendLeft + 26, y - 4,
        fmt::format("stroke=\"{}\" stroke-width=\"2.5\"{}", color, dashed ? " stroke-dasharray=\"6 4\"" : "").c_str());
    svg += textSvg(kLegendLeft + 34, y, "start", legendText(name));
    y += kLegendLine;
  };
  std::set<std::string> named;
  for (const ChartCurve& curve : chart.curves)
    if (named.insert(curve.name).second) entry(curve.name, curve.color, false);
  y += kLegendLine / 2;
  if (!chart.solid.empty()) entry(chart.solid, "currentColor", false);
  if (!chart.dashed.empty()) entry(chart.dashed, "currentColor", true);
  return svg;
}

}  // namespace

std::string chartSvg(const Chart& chart) {
  const LogAxis x = axisFor(chart, 0, kPlotLeft, kPlotRight), y = axisFor(chart, 1, kPlotBottom, kPlotTop);
  std::string svg = fmt::format(
      "<svg class=\"chart\" xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"DejaVu Sans, sans-serif\" font-size=\"12\">\n",
      kChartWidth, kChartHeight);
  svg += axesSvg(chart, x, y);
  for (const ChartCurve& curve : chart.curves) svg += curveSvg(curve, x, y);
  return svg + legendSvg(chart) + "</svg>\n";
}

std::string curveColor(std::size_t index) {
  constexpr std::array kColors = {"#1683ab", "#d1721b", "#2a9d5c", "#b0479a",
                                  "#c9a20a", "#6b7280", "#7d5ba6", "#a33a2c"};
  return kColors[index % kColors.size()];
}

}  // namespace hpsdf::app
