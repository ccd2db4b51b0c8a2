#include "coloring/color_view.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hpsdf::render {
namespace color_view_test {

const ColorMap& kDistanceMap = colorMap(MapKind::diverging, "");

LinearColor colorOf(int level) { return decodeSrgb(levelColor(level)); }

// Returns a slice that shows one cell of degree 2 and depth 3, with the same value everywhere.
ViewBuffers blank(int width, int height, float value = 10) {
  ViewBuffers buffers;
  const std::size_t size = std::size_t(width) * height;
  buffers.width = width;
  buffers.height = height;
  buffers.cell.assign(size, 0);
  buffers.degree.assign(size, 2);
  buffers.depth.assign(size, 3);
  buffers.value.assign(size, value);
  buffers.normal.assign(size, Eigen::Vector3f::UnitZ());
  buffers.distance.assign(size, 1);
  return buffers;
}

template <typename Visit>
void forEachSample(ViewBuffers& buffers, const Visit& visit) {
  for (int y = 0; y < buffers.height; ++y)
    for (int x = 0; x < buffers.width; ++x) visit(x, y, std::size_t(y) * buffers.width + x);
}

// Returns a slice with degree 2 in the left half, degree 1 in the right half, and nothing in the last four columns.
ViewBuffers twoCells(int size) {
  ViewBuffers buffers = blank(size, size);
  forEachSample(buffers, [&](int x, int, std::size_t i) {
    if (x >= size / 2) buffers.cell[i] = 7, buffers.degree[i] = 1;
    if (x >= size - 4) buffers.cell[i] = kNoCell, buffers.degree[i] = 0, buffers.value[i] = 0;
  });
  return buffers;
}

Image degrees(const ViewBuffers& buffers, int samples = 1) {
  return colorCellSlice(buffers, levelColors(buffers, ColorBy::degree), {samples, 1, 0.01});
}

double lightnessOf(Color color) { return toOklab(decodeSrgb(color)).lightness; }

// Returns how much darker a pixel is than the colour of its value, because of lines.
double inkAt(const Image& image, int x, int y, double value, const DistanceScale& scale) {
  return toOklab(kDistanceMap.at(0.5 + 0.5 * value / scale.range)).lightness - lightnessOf(image.at(x, y));
}

TEST(LevelSlice, givesCellsTheColorOfTheirLevelAndADarkOutline) {
  const Image image = degrees(twoCells(64));
  EXPECT_EQ(image.at(16, 40), levelColor(2));
  EXPECT_EQ(image.at(45, 40), levelColor(1));
  EXPECT_EQ(image.at(62, 40), paperColor());
  EXPECT_LT(lightnessOf(image.at(32, 40)), 0.75 * lightnessOf(image.at(45, 40))) << "no outline between the cells";
  EXPECT_LT(lightnessOf(image.at(60, 40)), 0.75 * lightnessOf(paperColor())) << "no outline where the domain ends";
  EXPECT_EQ(image.at(31, 40), image.at(16, 40)) << "an outline is one pixel wide";
  EXPECT_EQ(image.at(33, 40), image.at(45, 40));
}

TEST(LevelSlice, readsTheDepthsForColorsOfDepth) {
  const ViewBuffers buffers = twoCells(64);
  const Image image = colorCellSlice(buffers, levelColors(buffers, ColorBy::depth), {1, 1, 0.01});
  EXPECT_EQ(image.at(16, 40), levelColor(3));
}

TEST(LevelSlice, revealsSwappedAndUnknownLevels) {
  ViewBuffers wrong = twoCells(64);
  for (auto& degree : wrong.degree) degree = degree == 2 ? 1 : degree == 1 ? 2 : degree;
  const Image right = degrees(twoCells(64)), swapped = degrees(wrong);
  int different = 0;
  for (std::size_t i = 0; i < right.pixels.size(); ++i) different += right.pixels[i] != swapped.pixels[i];
  EXPECT_GT(different, 64 * 55);

  wrong.degree[10 * 64 + 10] = 200;
  EXPECT_EQ(degrees(wrong).at(10, 10), (Color{255, 0, 255}));
}

TEST(LevelSlice, fadesTheOutlinesOfTinyCells) {
  const auto meanOf = [](int cellSize) {
    ViewBuffers buffers = blank(96, 96);
    forEachSample(buffers, [&](int x, int y, std::size_t i) { buffers.cell[i] = y / cellSize * 96 + x / cellSize; });
    const Image image = degrees(buffers);
    LinearColor sum = LinearColor::Zero();
    for (const Color& pixel : image.pixels) sum += decodeSrgb(pixel);
    return toOklab(sum / float(image.pixels.size()));
  };
  for (int cellSize : {1, 2, 3, 4, 6, 12})
    EXPECT_LT(colorDifference(meanOf(cellSize), toOklab(colorOf(2))), 0.09) << cellSize;
  EXPECT_LT(colorDifference(meanOf(2), toOklab(colorOf(2))), 0.002);
  EXPECT_GT(colorDifference(meanOf(12), toOklab(colorOf(2))), 0.01) << "cells of 12 pixels have outlines";
}

TEST(LevelSlice, hasOutlinesOfOneWidthForAnyNumberOfSamples) {
  const auto darkness = [](int samples) {
    const Image image = degrees(twoCells(64 * samples), samples);
    const double full = decodeSrgb(image.at(45, 40)).sum();
    double sum = 0;
    for (int x = 28; x < 45; ++x) sum += std::max(0.0, 1 - decodeSrgb(image.at(x, 40)).sum() / full) * (x >= 32);
    return sum;
  };
  EXPECT_GT(darkness(1), 0.5);
  EXPECT_NEAR(darkness(2), darkness(1), 0.02);
  EXPECT_NEAR(darkness(5), darkness(1), 0.02);
}

TEST(LevelSlice, averagesSamplesInLinearLight) {
  // Degrees alternate from column to column of samples, so that every pixel contains equal parts of both.
  ViewBuffers buffers = blank(32, 32);
  forEachSample(buffers, [&](int x, int, std::size_t i) { buffers.cell[i] = x, buffers.degree[i] = x % 2 ? 5 : 2; });
  // Each sample becomes a cell of its own, because cells as high as the picture would have outlines.
  forEachSample(buffers, [&](int x, int y, std::size_t i) { buffers.cell[i] = y * 32 + x; });
  const Image image = degrees(buffers, 2);
  ASSERT_EQ(image.width, 16);
  const Color expected = encodeSrgb(0.5F * (colorOf(2) + colorOf(5)));
  for (const Color& pixel : image.pixels) EXPECT_EQ(pixel, expected);
}

TEST(LevelSlice, showsTheSurfaceAsALine) {
  ViewBuffers buffers = blank(64, 64);
  forEachSample(buffers, [&](int x, int, std::size_t i) { buffers.value[i] = 0.01F * float(x - 32); });
  const Image image = degrees(buffers);
  EXPECT_GT(lightnessOf(image.at(32, 20)), 0.95);
  EXPECT_LT(lightnessOf(image.at(30, 20)), lightnessOf(image.at(10, 20)));
  EXPECT_EQ(image.at(10, 20), levelColor(2));
  EXPECT_EQ(image.at(50, 20), levelColor(2));
}

// Returns a slice whose values rise by `slope` per column and pass 0 between columns 31 and 32.
ViewBuffers ramp(double slope) {
  ViewBuffers buffers = blank(64, 64);
  forEachSample(buffers, [&](int x, int, std::size_t i) { buffers.value[i] = static_cast<float>(slope * (x - 31.5)); });
  return buffers;
}

constexpr DistanceScale kScale = {1, 0.1, -0.32, 0.32};

TEST(DistanceSlice, hasADarkZeroLineThatIsAlikeOnBothSides) {
  const ViewBuffers buffers = ramp(0.01);
  const Image image = colorDistanceSlice(buffers, kScale, kDistanceMap, {1, 1, 0.01});
  EXPECT_LT(lightnessOf(image.at(31, 30)), 0.25);
  EXPECT_EQ(image.at(31, 30), image.at(32, 30));
  for (int k = 1; k < 6; ++k) {
    const double value = 0.01 * (k + 0.5);
    EXPECT_NEAR(inkAt(image, 31 - k, 30, -value, kScale), inkAt(image, 32 + k, 30, value, kScale), 0.02) << k;
  }
  EXPECT_NEAR(inkAt(image, 36, 30, 0.045, kScale), 0, 0.01) << "the line is too wide";
}

TEST(DistanceSlice, hasIsoLinesAtMultiplesOfTheStep) {
  const Image image = colorDistanceSlice(ramp(0.01), kScale, kDistanceMap, {1, 1, 0.01});
  for (int x = 0; x < 64; ++x) {
    const double value = 0.01 * (x - 31.5);
    const double fromLine = std::abs(value - 0.1 * std::round(value / 0.1)) / 0.01;
    if (std::abs(value) < 0.05) continue;
    if (fromLine < 0.6) {
      EXPECT_GT(inkAt(image, x, 10, value, kScale), 0.05) << x;
    } else if (fromLine > 1.1) {
      EXPECT_NEAR(inkAt(image, x, 10, value, kScale), 0, 0.01) << x;
    }
  }
}

TEST(DistanceSlice, hasLinesOfOneWidthForAnySlope) {
  for (double slope : {0.003, 0.01, 0.02}) {
    const Image image = colorDistanceSlice(ramp(slope), kScale, kDistanceMap, {1, 1, 0.01});
    double ink = 0;
    for (int x = 26; x < 38; ++x) ink += inkAt(image, x, 30, slope * (x - 31.5), kScale);
    EXPECT_NEAR(ink, 2.1, 0.4) << slope;
  }
}

TEST(DistanceSlice, hasNoBlotsAtJumps) {
  // Two cells, each with one iso-line; where the cells meet, their values differ by half an iso-line step.
  ViewBuffers buffers = ramp(0.01);
  forEachSample(buffers, [&](int x, int, std::size_t i) {
    if (x >= 45) buffers.cell[i] = 1, buffers.value[i] += 0.05F;
  });
  const Image image = colorDistanceSlice(buffers, kScale, kDistanceMap, {1, 1, 0.01});
  const auto ink = [&](int x) { return inkAt(image, x, 30, buffers.value[std::size_t(30) * 64 + x], kScale); };
  int dark = 0;
  for (int x = 40; x < 52; ++x) dark += ink(x) > 0.02;
  EXPECT_EQ(dark, 4) << "two lines, each between two columns";
  EXPECT_NEAR(ink(44), 0, 0.01) << "the jump is no line";
  EXPECT_NEAR(ink(45), 0, 0.01);
}

TEST(DistanceSlice, hasNoGapInTheZeroLineWhereTheFieldJumpsOverZero) {
  ViewBuffers buffers = blank(64, 64);
  forEachSample(buffers, [&](int x, int, std::size_t i) {
    buffers.cell[i] = x < 32 ? 0 : 1;
    buffers.value[i] = static_cast<float>(x < 32 ? 0.01 * (x - 36) : 0.01 * (x - 27));
  });
  const Image image = colorDistanceSlice(buffers, kScale, kDistanceMap, {1, 1, 0.01});
  EXPECT_LT(std::min(lightnessOf(image.at(31, 30)), lightnessOf(image.at(32, 30))), 0.3);
}

TEST(DistanceSlice, hasNoBlotsWhereTheDistanceIsAlmostConstant) {
  ViewBuffers buffers = blank(64, 64);
  forEachSample(buffers, [&](int x, int, std::size_t i) { buffers.value[i] = 0.1F + 1e-4F * float(x - 32); });
  const Image image = colorDistanceSlice(buffers, kScale, kDistanceMap, {1, 1, 0.01});
  int dark = 0;
  for (int x = 0; x < 64; ++x) dark += inkAt(image, x, 30, 0.1, kScale) > 0.02;
  EXPECT_LE(dark, 51);
  EXPECT_GE(dark, 1);
}

TEST(Surface, showsTheBackdropWhereARayMisses) {
  ViewBuffers buffers = blank(16, 16);
  std::fill(buffers.cell.begin(), buffers.cell.begin() + 16 * 8, kNoCell);
  const Camera camera = {{0, 0, 3}, {0, 0, -1}, {0.3, 0, 0}, {0, 0.3, 0}};
  const Image image = colorSurface(buffers, camera, {levelColors(buffers, ColorBy::normal)}, {1, 1, 1});
  EXPECT_EQ(image.at(3, 2), encodeSrgb(backdropColor(2.5 / 16)));
  EXPECT_GT(lightnessOf(image.at(3, 2)), lightnessOf(image.at(3, 12)));
}

TEST(Surface, isLitFromAboveLeftOfTheCameraInAnyDirection) {
  // Two cameras see the same scene: `turn` rotates the second camera together with the normals.
  const Eigen::Matrix3f turn = Eigen::AngleAxisf(1.3F, Eigen::Vector3f(1, 2, -1).normalized()).toRotationMatrix();
  const auto shaded = [&](const Eigen::Vector3f& normal, const Eigen::Matrix3f& rotation) {
    ViewBuffers buffers = blank(1, 1);
    buffers.normal[0] = rotation * normal;
    const auto turned = [&](double x, double y, double z) {
      return Vector3(rotation.cast<double>() * Vector3(x, y, z));
    };
    const Camera camera = {turned(0, 0, 3), turned(0, 0, -1), turned(0.3, 0, 0), turned(0, 0.3, 0)};
    return colorSurface(buffers, camera, {levelColors(buffers, ColorBy::normal)}, {1, 1, 1}).at(0, 0);
  };
  const Eigen::Vector3f left = Eigen::Vector3f(-1, 1, 1).normalized(), right = Eigen::Vector3f(1, -1, 1).normalized();
  const Eigen::Matrix3f still = Eigen::Matrix3f::Identity();
  EXPECT_GT(lightnessOf(shaded(left, still)), lightnessOf(shaded(right, still)) + 0.15);
  for (const auto& normal : {left, right})
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(shaded(normal, still)[i], shaded(normal, turn)[i], 1);
}

// Draws a wall in front of the camera with a vertical groove in its middle, `depth` deep and ten columns wide.
Image groove(double depth, ColorBy color, Projection projection) {
  ViewBuffers buffers = blank(200, 200);
  const bool parallel = projection == Projection::orthographic;
  const double half = parallel ? 0.9 : 0.3;  // both views are 1.8 wide at the wall
  const Camera camera = {{0, 0, 3}, {0, 0, -1}, {half, 0, 0}, {0, half, 0}, projection};
  forEachSample(buffers, [&](int x, int y, std::size_t i) {
    const Vector3 ray((2 * (x + 0.5) / 200 - 1) * 0.3, (1 - 2 * (y + 0.5) / 200) * 0.3, -1);
    const bool inGroove = x >= 95 && x < 105;
    buffers.distance[i] = static_cast<float>((inGroove ? 3 + depth : 3) * (parallel ? 1 : ray.norm()));
  });
  return colorSurface(buffers, camera, {levelColors(buffers, color)}, {1, 1, 1});
}

TEST(Surface, isDarkerInFoldsThanInTheOpen) {
  for (ColorBy color : {ColorBy::normal, ColorBy::depth})
    for (Projection projection : {Projection::perspective, Projection::orthographic}) {
      const Image flat = groove(0, color, projection), folded = groove(0.1, color, projection);
      for (int x : {95, 100, 104}) EXPECT_LT(lightnessOf(folded.at(x, 100)), 0.985 * lightnessOf(flat.at(x, 100))) << x;
      for (int x : {20, 60, 140, 180})
        EXPECT_NEAR(lightnessOf(folded.at(x, 100)), lightnessOf(flat.at(x, 100)), 0.01) << x;
    }
}

TEST(Surface, hasEvenLightOnAFlatWallForParallelRays) {
  const Image flat = groove(0, ColorBy::normal, Projection::orthographic);
  for (int x : {0, 50, 150, 199}) EXPECT_EQ(flat.at(x, 20), flat.at(100, 20)) << x;
  EXPECT_NE(groove(0, ColorBy::normal, Projection::perspective).at(0, 20), flat.at(0, 20));
}

TEST(Surface, hasNoBlackSpecksWhereNormalsFaceAway) {
  const Camera camera = {{0, 0, 3}, {0, 0, -1}, {0.3, 0, 0}, {0, 0.3, 0}};
  const auto shaded = [&](const Eigen::Vector3f& normal) {
    ViewBuffers buffers = blank(1, 1);
    buffers.normal[0] = normal.normalized();
    return lightnessOf(colorSurface(buffers, camera, {levelColors(buffers, ColorBy::normal)}, {1, 1, 1}).at(0, 0));
  };
  EXPECT_NEAR(shaded({0, -1, -0.6F}), shaded({0, -1, 0}), 0.01);
}

TEST(Surface, keepsLevelColorsRecognisableUnderShading) {
  const std::vector<int> levels = {2, 3, 4, 5, 6, 7};
  const Camera camera = {{0, 0, 3}, {0, 0, -1}, {0.3, 0, 0}, {0, 0.3, 0}};
  for (int level : levels)
    for (double tilt : {0.0, 0.4, 0.8}) {
      ViewBuffers buffers = blank(1, 1);
      buffers.degree[0] = static_cast<std::uint8_t>(level);
      buffers.normal[0] = Eigen::Vector3f(float(-std::sin(tilt)), 0, float(std::cos(tilt)));
      const Oklab shown = toOklab(
          decodeSrgb(colorSurface(buffers, camera, {levelColors(buffers, ColorBy::degree)}, {1, 1, 1}).at(0, 0)));
      int nearest = 0;
      for (int candidate : levels)
        if (nearest == 0 ||
            colorDifference(shown, toOklab(colorOf(candidate))) < colorDifference(shown, toOklab(colorOf(nearest))))
          nearest = candidate;
      EXPECT_EQ(nearest, level) << "tilted by " << tilt;
    }
}

}  // namespace color_view_test
}  // namespace hpsdf::render
