#include "pictures/legends.h"

#include <fmt/format.h>

#include "hpsdf/field.h"
#include "hpsdf/types.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr int kLevelBarHeight = 18;
constexpr int kColorBarWidth = 420;
constexpr int kColorBarMargin = 30;  // space for the half of a mark's text that lies beside the bar

}  // namespace

LevelColors levelColors(const render::Legend& legend) {
  LevelColors colors;
  for (const render::Legend::Level& shown : legend.levels) colors[shown.level] = shown.color;
  return colors;
}

std::string sharesSvg(int width, const std::map<int, double>& shares, const LevelColors& colors, bool tellsShares) {
  std::string parts;
  double from = 0;
  for (const auto& [level, share] : shares) {
    const render::Color& color = colors.at(level);
    parts +=
        fmt::format("<rect x=\"{:.2f}\" y=\"0\" width=\"{:.2f}\" height=\"{}\" fill=\"{}\"><title>{}</title></rect>",
                    width * from, width * share, kLevelBarHeight, colorText(color),
                    tellsShares ? fmt::format("{}: {:.2f} %", levelName(level), 100 * share) : levelName(level));
    const bool isLight = 0.3 * color[0] + 0.6 * color[1] + 0.1 * color[2] > 128;
    if (width * share > (level == kExactDegree ? 34 : 12))
      parts += fmt::format("<text x=\"{:.2f}\" y=\"13\" fill=\"{}\">{}</text>", width * from + width * share / 2,
                           isLight ? "#000000" : "#ffffff", levelName(level));
    from += share;
  }
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"DejaVu Sans, sans-serif\" font-size=\"11\" text-anchor=\"middle\">{2}</svg>",
      width, kLevelBarHeight, parts);
}

std::string levelsSvg(const LevelColors& colors) {
  const int width = colors.contains(kExactDegree) ? 36 : 26;
  std::map<int, double> equal;
  for (const auto& [level, color] : colors) equal[level] = 1 / double(colors.size());
  return sharesSvg(width * int(colors.size()), equal, colors, false);
}

std::string barSvg(const render::Legend& legend) {
  std::string parts;
  const double step = double(kColorBarWidth) / double(legend.bar.size());
  for (std::size_t n = 0; n < legend.bar.size(); ++n)
    parts += fmt::format(
        "<rect x=\"{:.2f}\" y=\"0\" width=\"{:.2f}\" height=\"{}\" fill=\"{}\" shape-rendering=\"crispEdges\"/>",
        kColorBarMargin + step * double(n), step, kLevelBarHeight, colorText(legend.bar[n]));
  for (const render::Legend::Mark& mark : legend.marks)
    parts += fmt::format(
        "<path d=\"M{0:.2f} {1}v5\" stroke=\"currentColor\"/><text x=\"{0:.2f}\" y=\"{2}\" "
        "fill=\"currentColor\">{3}</text>",
        kColorBarMargin + mark.t * kColorBarWidth, kLevelBarHeight, kLevelBarHeight + 17, mark.text);
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"DejaVu Sans, sans-serif\" font-size=\"11\" text-anchor=\"middle\">{2}</svg>",
      kColorBarWidth + 2 * kColorBarMargin, kLevelBarHeight + 20, parts);
}

}  // namespace hpsdf::app
