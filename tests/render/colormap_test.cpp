#include "image/colormap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "hpsdf/error.h"
#include "hpsdf/types.h"
#include "picture/cracks.h"
#include "support/color_vision.h"

namespace hpsdf::render {
namespace colormap_test {

double lightnessOf(Color color) { return toOklab(decodeSrgb(color)).lightness; }

TEST(Color, returnsUnchangedFromLinearLight) {
  for (int value = 0; value < 256; ++value) {
    const auto v = static_cast<std::uint8_t>(value);
    EXPECT_EQ(encodeSrgb(decodeSrgb({v, 0, v})), (Color{v, 0, v}));
  }
  EXPECT_EQ(encodeSrgb({-1, 2, 0.2140411F}),
            (Color{0, 255, 127}));  // half of the code range, by the sRGB standard's curve
}

TEST(Color, returnsUnchangedFromOklabAndHasItsKnownCorners) {
  const Oklab white = toOklab({1, 1, 1});
  EXPECT_NEAR(white.lightness, 1, 1e-6);
  EXPECT_NEAR(std::hypot(white.a, white.b), 0, 1e-6);
  EXPECT_NEAR(toOklab({1, 0, 0}).lightness, 0.62796, 1e-4);  // red, from Ottosson's article about Oklab
  for (float r : {0.0F, 0.3F, 1.0F})
    for (float g : {0.0F, 0.5F, 1.0F})
      for (float b : {0.0F, 0.7F, 1.0F})
        EXPECT_LT((fromOklab(toOklab({r, g, b})) - LinearColor(r, g, b)).norm(), 1e-4) << r << " " << g << " " << b;
  // A colour beyond the gamut keeps its lightness and hue, and loses chroma.
  const Oklab vivid = toOklab(fromOklch(0.5, 0.9, 145));
  EXPECT_NEAR(vivid.lightness, 0.5, 1e-3);
  EXPECT_NEAR(std::atan2(vivid.b, vivid.a), 145 * 3.14159265 / 180, 0.01);
}

TEST(LevelColor, isDarkerForHigherLevels) {
  for (int level = 1; level < kDistinctLevels; ++level)
    EXPECT_LT(lightnessOf(levelColor(level)), lightnessOf(levelColor(level - 1)) - 0.005) << level;
  for (int level = kDistinctLevels + 1; level <= kMaxDegree; ++level)
    EXPECT_LT(lightnessOf(levelColor(level)), lightnessOf(levelColor(level - 1))) << level;
}

TEST(LevelColor, isDifferentForEachLevel) {
  std::set<Color> colors = {levelColor(kExactDegree)};
  for (int level = 0; level <= kMaxDegree; ++level) colors.insert(levelColor(level));
  EXPECT_EQ(colors.size(), std::size_t(kMaxDegree) + 2);
  for (const int unknown : {-1, kExactDegree + 1, 255}) {
    EXPECT_EQ(levelColor(unknown), (Color{255, 0, 255})) << "a level that does not occur must stand out";
    EXPECT_FALSE(colors.contains(levelColor(unknown)));
  }
}

/// Cracks must differ from the shaded colours of levels and quantities, and from clay (the plain surface) in any light.
TEST(CrackColor, differsFromEveryOtherForEveryEye) {
  std::vector<LinearColor> others;
  const auto addShaded = [&](const LinearColor& color, std::initializer_list<float> lights) {
    for (const float light : lights) others.push_back((color * light).cwiseMin(1.0F));
  };
  const ColorMap& map = colorMap(MapKind::ordered, "");
  for (double t = 0; t <= 1; t += 0.02) addShaded(map.at(t), {0.5F, 0.75F, 1.0F, 1.08F});
  for (int level = 0; level < kDistinctLevels; ++level)
    addShaded(decodeSrgb(levelColor(level)), {0.5F, 0.75F, 1.0F, 1.08F});
  addShaded(decodeSrgb(levelColor(kExactDegree)), {0.5F, 0.75F, 1.0F, 1.08F});
  addShaded(decodeSrgb({210, 153, 119}), {0.15F, 0.25F, 0.4F, 0.6F, 0.8F, 1.0F, 1.2F});
  support::LeastDifference least;
  for (const LinearColor& other : others) {
    const auto found = support::leastDifference({{"a crack", kCrackColor}}, {{"another", encodeSrgb(other)}});
    if (found.difference < least.difference) least = found;
  }
  EXPECT_GT(least.difference, 8) << least.text;
}

TEST(ColorMaps, riseInLightnessOrFallFromWhiteOnBothSides) {
  constexpr int kSteps = 64;
  for (const ColorMap& map : colorMaps()) {
    const std::vector<Color> colors = colorsOf(map, kSteps + 1);
    for (int i = 1; i <= kSteps; ++i) {
      const double step = lightnessOf(colors[std::size_t(i)]) - lightnessOf(colors[std::size_t(i - 1)]);
      const bool rises = map.kind == MapKind::ordered || i <= kSteps / 2;
      EXPECT_GT(rises ? step : -step, 0.002) << map.name << " at " << i;
    }
    EXPECT_EQ(map.at(-3), map.at(0)) << map.name;
    EXPECT_EQ(map.at(7), map.at(1)) << map.name;
    if (map.kind == MapKind::ordered) continue;
    EXPECT_GT(lightnessOf(colors[kSteps / 2]), 0.97) << map.name;
    for (int i = 0; i <= kSteps / 2; ++i)
      EXPECT_NEAR(lightnessOf(colors[std::size_t(i)]), lightnessOf(colors[std::size_t(kSteps - i)]), 0.06) << map.name;
  }
}

TEST(ColorMaps, areFoundByNameAndKind) {
  EXPECT_EQ(colorMap(MapKind::ordered, "").name, "violet-yellow");
  EXPECT_EQ(colorMap(MapKind::diverging, "").name, "blue-red");
  EXPECT_EQ(colorMap(MapKind::ordered, "heat").name, "heat");
  try {
    colorMap(MapKind::ordered, "blue-red");
    FAIL() << "a diverging map suits no quantity";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "map: blue-red is not for quantities; choose one of violet-yellow, heat, blue, grey");
  }
}

TEST(ColorMaps, ofDistancesAreBlueInsideAndRedOutsideByDefault) {
  const ColorMap& map = colorMap(MapKind::diverging, "");
  for (double t = 0.55; t <= 1; t += 0.05) {
    EXPECT_LT(toOklab(map.at(1 - t)).b, 0) << "blue inside";
    EXPECT_GT(toOklab(map.at(t)).a, 0) << "red outside";
  }
}

TEST(ColorScale, spansPowersOfTenOrStartsAtZero) {
  const ColorScale decades = ColorScale::around(3e-5, 0.02, true);
  EXPECT_DOUBLE_EQ(decades.low(), 1e-5);
  EXPECT_DOUBLE_EQ(decades.high(), 0.1);
  EXPECT_NEAR(decades.fraction(1e-3), 0.5, 1e-12);
  EXPECT_EQ(decades.fraction(0), 0);
  EXPECT_EQ(decades.fraction(-1), 0);
  EXPECT_EQ(decades.fraction(7), 1);
  EXPECT_EQ(decades.fraction(std::numeric_limits<double>::quiet_NaN()), 0);
  for (const std::string name : {"", "heat"}) {
    const ColorScale scale = ColorScale::around(3e-5, 0.02, true, name);
    const ColorMap& map = colorMap(MapKind::ordered, name);
    EXPECT_EQ(scale(1e-9), map.at(0));
    EXPECT_EQ(scale(1e-3), map.at(0.5));
    EXPECT_EQ(scale(5), map.at(1));
  }
  EXPECT_DOUBLE_EQ(ColorScale::around(1e-30, 1, true).low(), 1e-6) << "six decades at most";
  EXPECT_DOUBLE_EQ(ColorScale::around(1, 1, true).low(), 0.1) << "one at least";

  const ColorScale even = ColorScale::around(0.3, 0.37, false);
  EXPECT_EQ(even.low(), 0);
  EXPECT_DOUBLE_EQ(even.high(), 0.4);
  EXPECT_NEAR(even.fraction(0.1), 0.25, 1e-12);
  for (const bool logarithmic : {false, true}) EXPECT_EQ(ColorScale::around(0, 0, logarithmic).high(), 1);
}

TEST(ColorScale, hasMarksAtPowersOfTenOrEvenSteps) {
  using testing::DoubleNear;
  using testing::Pointwise;
  EXPECT_THAT(scaleMarks(ColorScale(1e-3, 1, true)), Pointwise(DoubleNear(1e-12), {1e-3, 1e-2, 1e-1, 1.0}));
  EXPECT_THAT(scaleMarks(ColorScale(2e-3, 0.5, true)), Pointwise(DoubleNear(1e-12), {1e-2, 1e-1}));
  EXPECT_THAT(scaleMarks(ColorScale(0, 0.4, false)), Pointwise(DoubleNear(1e-12), {0.0, 0.1, 0.2, 0.3, 0.4}));
  EXPECT_THAT(scaleMarks(ColorScale(2, 6, true)), Pointwise(DoubleNear(1e-12), {2.0, 3.0, 4.0, 5.0, 6.0}));
}

TEST(DistanceScale, hasARangeOfFewDigitsAndAboutTwelveLines) {
  for (double size : {1e-5, 0.013, 0.4, 1.0, 1.109, 7.3, 355.0, 2e6})
    for (double minimum : {-1.0, -0.3, 0.0, 0.6}) {
      const DistanceScale scale = distanceScale(minimum * size, size);
      EXPECT_GE(scale.range, size);
      EXPECT_LE(scale.range, 1.34 * size);
      const double lines = (1 - minimum) * size / scale.step;
      EXPECT_GE(lines, 7.5) << minimum << " to 1 times " << size;
      EXPECT_LE(lines, 19.5) << minimum << " to 1 times " << size;
      const double digit = scale.step / std::pow(10.0, std::floor(std::log10(scale.step) + 1e-9));
      EXPECT_TRUE(std::abs(digit - 1) < 1e-6 || std::abs(digit - 2) < 1e-6 || std::abs(digit - 5) < 1e-6) << scale.step;
    }
  EXPECT_GT(distanceScale(0, 0).range, 0);
  EXPECT_GT(distanceScale(0.5, 0.5).step, 0.01);
}

}  // namespace colormap_test
}  // namespace hpsdf::render
