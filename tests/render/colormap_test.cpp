#include "image/colormap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numeric>

#include "hpsdf/types.h"
#include "picture/cracks.h"

namespace hpsdf::render {
namespace colormap_test {

// The colour vision that a test simulates. For a dichromat, the missing cone's response is replaced by a combination of
// the other two cones that keeps white and one more colour unchanged (after Viénot, Brettel & Mollon 1999).
enum class Vision { normal, protan, deutan, tritan };

Eigen::Matrix3d coneFromLinear() {
  // Matrices from CIE XYZ to Hunt-Pointer-Estevez cones (normalised to D65), and from linear sRGB to CIE XYZ.
  Eigen::Matrix3d coneFromXyz, xyzFromLinear;
  coneFromXyz << 0.4002, 0.7076, -0.0808, -0.2263, 1.1653, 0.0457, 0, 0, 0.9182;
  xyzFromLinear << 0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505;
  return coneFromXyz * xyzFromLinear;
}

LinearColor seen(const LinearColor& color, Vision vision) {
  if (vision == Vision::normal) return color;
  const Eigen::Matrix3d toCones = coneFromLinear();
  const int missing = static_cast<int>(vision) - 1;
  const int one = (missing + 1) % 3, two = (missing + 2) % 3;
  const Eigen::Vector3d white = toCones * Eigen::Vector3d::Ones();
  const Eigen::Vector3d anchor =
      toCones * (vision == Vision::tritan ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ());
  Eigen::Matrix2d known;
  known << white[one], white[two], anchor[one], anchor[two];
  const Eigen::Vector2d weights = known.inverse() * Eigen::Vector2d(white[missing], anchor[missing]);
  Eigen::Vector3d cones = toCones * color.cast<double>();
  cones[missing] = weights[0] * cones[one] + weights[1] * cones[two];
  const Eigen::Vector3d linear = toCones.inverse() * cones;
  return linear.cast<float>().cwiseMax(0.0F).cwiseMin(1.0F);
}

std::vector<int> firstLevels(int count) {
  std::vector<int> levels(count);
  std::iota(levels.begin(), levels.end(), 2);
  return levels;
}

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

TEST(LevelMap, risesStrictlyInLightnessForUpTo29Levels) {
  for (int count = 2; count <= 29; ++count) {
    const LevelMap map(firstLevels(count));
    for (int level = 3; level < count + 2; ++level) {
      // Lightness is compared for colours as stored, with eight bits per channel.
      const double below = toOklab(decodeSrgb(encodeSrgb(map(level - 1)))).lightness;
      const double here = toOklab(decodeSrgb(encodeSrgb(map(level)))).lightness;
      EXPECT_GT(here, below + 0.01) << count << " levels, level " << level;
    }
  }
}

TEST(LevelMap, hasNeighboursThatEveryEyeDistinguishes) {
  for (Vision vision : {Vision::normal, Vision::protan, Vision::deutan, Vision::tritan})
    for (int count = 2; count <= 10; ++count) {
      const LevelMap map(firstLevels(count));
      for (int level = 3; level < count + 2; ++level)
        // A difference of 0.02 is just noticeable; neighbours must be distinguishable at a glance.
        EXPECT_GT(colorDifference(toOklab(seen(map(level - 1), vision)), toOklab(seen(map(level), vision))), 0.05)
            << count << " levels, level " << level << ", vision " << static_cast<int>(vision);
    }
}

/// Exact leaves must stand out among the leaves of all degrees, which keep their colours.
TEST(LevelMap, hasAColorForExactLeavesThatEveryEyeDistinguishes) {
  for (int count = 1; count <= 30; ++count) {
    std::vector<int> levels(count);
    std::iota(levels.begin(), levels.end(), 1);
    const LevelMap without(levels);
    levels.push_back(kExactDegree);
    const LevelMap map(levels);
    for (int level = 1; level <= count; ++level) {
      EXPECT_EQ(map(level), without(level));
      for (Vision vision : {Vision::normal, Vision::protan, Vision::deutan, Vision::tritan})
        EXPECT_GT(colorDifference(toOklab(seen(map(kExactDegree), vision)), toOklab(seen(map(level), vision))), 0.15)
            << count << " levels, level " << level << ", vision " << static_cast<int>(vision);
    }
  }
}

/// Cracks must differ from the shaded colours of levels and quantities, and from clay (the plain surface) in any light.
TEST(CrackColor, differsFromEveryOtherForEveryEye) {
  std::vector<LinearColor> others;
  for (double t = 0; t <= 1; t += 0.02)
    for (const float light : {0.5F, 0.75F, 1.0F, 1.08F}) others.push_back(orderedColor(t) * light);
  for (const float light : {0.5F, 0.75F, 1.0F, 1.08F}) others.push_back(exactColor() * light);
  for (const float light : {0.15F, 0.25F, 0.4F, 0.6F, 0.8F, 1.0F, 1.2F})
    others.push_back(decodeSrgb({210, 153, 119}) * light);
  const LinearColor crack = decodeSrgb(kCrackColor);
  for (Vision vision : {Vision::normal, Vision::protan, Vision::deutan, Vision::tritan})
    for (const LinearColor& other : others)
      EXPECT_GT(colorDifference(toOklab(seen(crack, vision)), toOklab(seen(other.cwiseMin(1.0F), vision))), 0.08)
          << "vision " << static_cast<int>(vision) << ", " << other.transpose();
}

TEST(ColorVisionSimulation, confusesTheColorsThatDichromatsConfuse) {
  // Negative control of the simulation: a red and a green that look alike without M cones.
  const LinearColor red = fromOklch(0.60, 0.12, 30), green = fromOklch(0.60, 0.12, 135);
  const auto difference = [&](Vision v) { return colorDifference(toOklab(seen(red, v)), toOklab(seen(green, v))); };
  EXPECT_GT(difference(Vision::normal), 0.15);
  EXPECT_LT(difference(Vision::deutan), 0.5 * difference(Vision::normal));
  EXPECT_LT((seen({1, 1, 1}, Vision::protan) - LinearColor(1, 1, 1)).norm(), 1e-4);
}

TEST(LevelMap, spreadsTheLevelsThatOccur) {
  const std::vector<int> levels = {9, 2, 5, 2};
  const LevelMap map(levels);
  EXPECT_EQ(map.levels(), (std::vector<int>{2, 5, 9}));
  EXPECT_EQ(map(2), orderedColor(0));
  EXPECT_EQ(map(5), orderedColor(0.5));
  EXPECT_EQ(map(9), orderedColor(1));
  EXPECT_EQ(map(3), LinearColor(1, 0, 1)) << "a level that does not occur must stand out";
  EXPECT_EQ(LevelMap(std::vector<int>{4})(4), orderedColor(0.5));
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
  EXPECT_EQ(decades(1e-9), orderedColor(0));
  EXPECT_EQ(decades(1e-3), orderedColor(0.5));
  EXPECT_EQ(decades(5), orderedColor(1));
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

TEST(DivergingMap, isWhiteAtZeroAndDarkensAlike) {
  EXPECT_GT(toOklab(divergingColor(0)).lightness, 0.97);
  for (double t = 0.05; t <= 1; t += 0.05) {
    const Oklab inside = toOklab(divergingColor(-t)), outside = toOklab(divergingColor(t));
    EXPECT_LT(inside.lightness, toOklab(divergingColor(-t + 0.05)).lightness);
    EXPECT_LT(outside.lightness, toOklab(divergingColor(t - 0.05)).lightness);
    EXPECT_NEAR(inside.lightness, outside.lightness, 0.06);
    EXPECT_LT(inside.b, 0) << "blue inside";
    EXPECT_GT(outside.a, 0) << "red outside";
    EXPECT_GT(outside.b, 0);
  }
  EXPECT_EQ(divergingColor(7), divergingColor(1));
}

TEST(DivergingMap, hasSidesThatEveryEyeDistinguishes) {
  for (Vision vision : {Vision::protan, Vision::deutan, Vision::tritan})
    for (double t : {0.3, 0.6, 1.0})
      EXPECT_GT(colorDifference(toOklab(seen(divergingColor(-t), vision)), toOklab(seen(divergingColor(t), vision))),
                0.08)
          << t;
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
