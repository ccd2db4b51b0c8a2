#include "pictures/colors_help.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "hpsdf/render/color_maps.h"
#include "hpsdf/types.h"
#include "pictures/picture_arguments.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr int kBarCells = 48;    // characters of a map's bar
constexpr int kMapSamples = 5;   // colours of a map that are given as text
constexpr int kSwatchCells = 4;  // characters of a level's bar

/// Returns blanks on a background of this colour.
std::string colored(const render::Color& color, int cells) {
  return fmt::format("\x1b[48;2;{};{};{}m{:{}}\x1b[0m", color[0], color[1], color[2], "", cells);
}

std::string levelLine(int level, bool showsColors) {
  const render::Color color = render::levelColor(level);
  return fmt::format("  {:<6} {}{}\n", levelName(level), showsColors ? colored(color, kSwatchCells) + " " : "",
                     colorText(color));
}

std::string mapLine(const render::ColorMap& map, bool showsColors) {
  std::string colors;
  if (showsColors) {
    for (const render::Color& color : render::colorsOf(map, kBarCells)) colors += colored(color, 1);
  } else {
    std::vector<std::string> texts;
    for (const render::Color& color : render::colorsOf(map, kMapSamples)) texts.push_back(colorText(color));
    colors = fmt::format("{}", fmt::join(texts, " "));
  }
  return fmt::format("  {:<14} {}  {}\n", map.name, colors, map.explanation);
}

std::string mapLines(render::MapKind kind, bool showsColors) {
  std::string text;
  for (const render::ColorMap& map : render::colorMaps())
    if (map.kind == kind) text += mapLine(map, showsColors);
  return text;
}

}  // namespace

std::string colorsHelp(bool showsColors) {
  std::string text = fmt::format(
      "What colours show is chosen by --color:\n  {}\n\n"
      "Degrees and depths have the same colours in every picture. Up to {} they are darker the higher, and everybody\n"
      "can tell them apart, also with a colour vision deficiency; from {} on they are greens that\n"
      "darken from a light one and are closer to each other.\n",
      fmt::join(colorNames(), ", "), render::kDistinctLevels - 1, render::kDistinctLevels);
  for (int level = 0; level < render::kDistinctLevels + 3; ++level) text += levelLine(level, showsColors);
  text += levelLine(kExactDegree, showsColors);
  text += "\nMaps for quantities (--map), from the lowest value to the highest; the first is the standard one:\n";
  text += mapLines(render::MapKind::ordered, showsColors);
  text += "\nMaps for the signed distance, from inside to outside:\n";
  return text + mapLines(render::MapKind::diverging, showsColors);
}

}  // namespace hpsdf::app
