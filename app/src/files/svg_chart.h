#pragma once
// Draws curves over two logarithmic axes, for HTML pages and as files of their own.

#include <array>
#include <span>
#include <string>
#include <vector>

#include "files/output_folder.h"

namespace hpsdf::app {

struct ChartCurve {
  std::string name;   ///< name in the legend; curves with equal names share one entry and belong to one colour
  std::string color;  ///< "#rrggbb"
  bool dashed = false;
  std::vector<std::array<double, 2>> points = {};  ///< in ascending order of x; points at or below 0 are left out
};

struct Chart {
  std::string xLabel, yLabel;  ///< titles of the axes, with their units
  std::string solid, dashed;   ///< meanings of solid and of dashed curves; "" if there are none
  std::vector<ChartCurve> curves = {};
};

/// Writes the chart as NAME.svg and, if this build writes PDF files, as NAME.pdf. Returns the names of the files.
std::vector<std::string> writeChart(OutputFolder& folder, const std::string& name, const Chart& chart);

/// Returns the chart as an SVG element. Axes and texts have the colour of the text around the element.
std::string chartSvg(const Chart& chart);

/// Returns the colours of curves as "#rrggbb", which can be told apart with every kind of colour vision, on light and
/// on dark pages.
std::span<const std::string> curveColors();

/// Returns the colour of curve number `index`. After the last of `curveColors`, the first one follows again.
std::string curveColor(std::size_t index);

}  // namespace hpsdf::app
