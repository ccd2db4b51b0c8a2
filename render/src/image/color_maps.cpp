#include "hpsdf/render/color_maps.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "hpsdf/error.h"
#include "hpsdf/types.h"
#include "image/color.h"

namespace hpsdf::render {
namespace {

/// The colours of the levels that differ most, found by simulated annealing under the conditions that color_sets_test
/// checks. They become darker from level to level, so that coarse cells, which fill large areas, are light. Cool and
/// warm hues take turns among the dark ones, because lightness alone gives fewer distinct colours.
constexpr std::array<Color, kDistinctLevels> kLevels = {
    {{252, 210, 9}, {149, 159, 99}, {71, 157, 152}, {22, 82, 176}, {88, 75, 87}, {86, 8, 19}}};
constexpr Color kExact = {180, 36, 5};

Oklab mixOklab(const Oklab& a, const Oklab& b, double t) {
  return {std::lerp(a.lightness, b.lightness, t), std::lerp(a.a, b.a, t), std::lerp(a.b, b.b, t)};
}

/// A path through polar Oklab coordinates, straight from 0 to 1.
struct Polar {
  double lightness, chroma, hue;

  LinearColor towards(const Polar& end, double t) const {
    t = std::clamp(t, 0.0, 1.0);
    return fromOklch(std::lerp(lightness, end.lightness, t), std::lerp(chroma, end.chroma, t),
                     std::lerp(hue, end.hue, t));
  }
};

LinearColor violetToYellow(double t) {
  t = std::clamp(t, 0.0, 1.0);
  const double lightness = 0.385 + 0.445 * t;
  // The hue runs from violet over blue, teal and green to a golden yellow. The shorter way around the hue circle would
  // pass through muddy pinks. A paler end would be lost on white paper.
  const double hue = 302 - 227 * std::pow(t, 0.8);
  // The chroma is lowest in the middle of the map, where the gamut of sRGB is narrow and greens would stand out.
  const double chroma = 0.103 + (t < 0.5 ? 0.034 : 0.067) * (2 * t - 1) * (2 * t - 1);
  return fromOklch(lightness, chroma, hue);
}

LinearColor heat(double t) { return Polar{0.25, 0.10, 15}.towards({0.86, 0.17, 85}, t); }
LinearColor blues(double t) { return Polar{0.26, 0.11, 268}.towards({0.81, 0.10, 245}, t); }
LinearColor greys(double t) { return Polar{0.20, 0, 0}.towards({0.725, 0, 0}, t); }

/// One half of a diverging map. Its colours from white to the end form a quadratic Bézier curve, whose control point is
/// a light, saturated colour. The side is then visible even close to the middle.
struct HalfMap {
  Oklab middle, end;

  LinearColor at(double s) const {
    const Oklab white = {0.985, 0, 0};
    return fromOklab(mixOklab(mixOklab(white, middle, s), mixOklab(middle, end, s), s));
  }
};

LinearColor diverging(const HalfMap& inside, const HalfMap& outside, double t) {
  const double s = std::clamp(2 * t - 1, -1.0, 1.0);
  return s < 0 ? inside.at(-s) : outside.at(s);
}

LinearColor blueToRed(double t) {
  return diverging({{0.77, -0.045, -0.105}, {0.36, -0.015, -0.135}}, {{0.80, 0.070, 0.085}, {0.40, 0.125, 0.070}}, t);
}
LinearColor purpleToGreen(double t) {
  return diverging({{0.77, 0.075, -0.090}, {0.36, 0.090, -0.110}}, {{0.82, -0.095, 0.080}, {0.40, -0.090, 0.070}}, t);
}
LinearColor brownToTeal(double t) {
  return diverging({{0.80, 0.050, 0.110}, {0.38, 0.050, 0.075}}, {{0.80, -0.095, -0.035}, {0.39, -0.070, -0.025}}, t);
}

}  // namespace

Color levelColor(int level) {
  if (level == kExactDegree) return kExact;
  if (level < 0 || level > kMaxDegree) return {255, 0, 255};
  if (level < kDistinctLevels) return kLevels[std::size_t(level)];
  // Higher levels are greens, the darker the higher. The lowest of them, which occur most, are the farthest apart.
  return encodeSrgb(fromOklch(0.38 + 0.44 * std::pow(0.87, level - kDistinctLevels), 0.15, 130));
}

std::span<const ColorMap> colorMaps() {
  static const std::vector<ColorMap> maps = {
      {"violet-yellow", MapKind::ordered, "violet over blue and green to yellow", violetToYellow},
      {"heat", MapKind::ordered, "dark red over orange to yellow", heat},
      {"blue", MapKind::ordered, "dark to light blue, one hue", blues},
      {"grey", MapKind::ordered, "dark to light grey, for print without colours", greys},
      {"blue-red", MapKind::diverging, "blue inside, red outside", blueToRed},
      {"purple-green", MapKind::diverging, "purple inside, green outside", purpleToGreen},
      {"brown-teal", MapKind::diverging, "brown inside, teal outside", brownToTeal}};
  return maps;
}

const ColorMap& colorMap(MapKind kind, const std::string& name) {
  std::string names;
  for (const ColorMap& map : colorMaps()) {
    if (map.kind != kind) continue;
    if (name.empty() || map.name == name) return map;
    names += (names.empty() ? "" : ", ") + map.name;
  }
  throw Error("map: " + name + " is not for " + (kind == MapKind::ordered ? "quantities" : "signed distances") +
              "; choose one of " + names);
}

std::vector<Color> colorsOf(const ColorMap& map, int count) {
  std::vector<Color> colors;
  for (int i = 0; i < count; ++i) colors.push_back(encodeSrgb(map.at(double(i) / (count - 1))));
  return colors;
}

}  // namespace hpsdf::render
