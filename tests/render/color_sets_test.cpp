// Colours that share a picture: each pair must be distinguishable for all readers.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "coloring/color_view.h"
#include "coloring/surface_shader.h"
#include "hpsdf/render/color_maps.h"
#include "hpsdf/types.h"
#include "picture/cracks.h"
#include "picture/defect_marks.h"
#include "picture/line_layout.h"
#include "picture/slice_lines.h"
#include "support/color_vision.h"

namespace hpsdf::render {
namespace color_sets_test {

using support::colorDifference2000;
using support::Lab;
using support::leastDifference;
using support::LeastDifference;
using Colors = std::vector<support::NamedColor>;

constexpr double kLeast = 20;

std::string hex(Color color) {
  std::string text = "#";
  for (const int channel : color)
    for (const int digit : {channel / 16, channel % 16}) text += "0123456789abcdef"[digit];
  return text;
}

Colors named(const std::string& name, std::span<const Color> colors) {
  Colors result;
  for (std::size_t i = 0; i < colors.size(); ++i)
    result.push_back({name + " " + std::to_string(i) + " " + hex(colors[i]), colors[i]});
  return result;
}

Colors joined(std::vector<Colors> sets) {
  Colors all;
  for (const Colors& set : sets) all.insert(all.end(), set.begin(), set.end());
  return all;
}

Colors paper() { return {{"the paper", paperColor()}}; }
Colors backdrop() {
  return {{"the backdrop's top", encodeSrgb(backdropColor(0))},
          {"the backdrop's bottom", encodeSrgb(backdropColor(1))}};
}
Colors crack() { return {{"cracks", kCrackColor}}; }
Colors clay() { return {{"clay", surfaceColor()}}; }
Colors exact() { return {{"exact leaves", levelColor(kExactDegree)}}; }

Colors levels(int first, int last) {
  Colors result;
  for (int level = first; level <= last; ++level)
    result.push_back({"level " + std::to_string(level), levelColor(level)});
  return result;
}
Colors distinctLevels() { return joined({levels(0, kDistinctLevels - 1), exact()}); }

Colors defects() {
  Colors result;
  for (std::size_t kind = 0; kind < kDefectKinds; ++kind)
    result.push_back({"defects of kind " + std::to_string(kind), defectColor(DefectKind(kind))});
  return result;
}

/// Expects each colour to differ by kLeast from the others and from all of the grounds, which may be alike.
void expectDistinct(const Colors& colors, const Colors& grounds) {
  for (const LeastDifference& least : {leastDifference(colors), leastDifference(colors, grounds)})
    EXPECT_GE(least.difference, kLeast) << least.text;
}

/// Pairs of the table of Sharma, Wu and Dalal (2005).
TEST(ColorDifference2000, hasThePublishedValues) {
  struct Pair {
    Lab one, other;
    double difference;
  };
  const std::vector<Pair> pairs = {{{50, 2.6772, -79.7751}, {50, 0, -82.7485}, 2.0425},
                                   {{50, 3.1571, -77.2803}, {50, 0, -82.7485}, 2.8615},
                                   {{50, 2.8361, -74.0200}, {50, 0, -82.7485}, 3.4412},
                                   {{50, -1.3802, -84.2814}, {50, 0, -82.7485}, 1.0000},
                                   {{50, 0, 0}, {50, -1, 2}, 2.3669},
                                   {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0009}, 7.1792},
                                   {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0011}, 7.2195},
                                   {{50, -0.0010, 2.4900}, {50, 0.0009, -2.4900}, 4.8045},
                                   {{50, -0.0010, 2.4900}, {50, 0.0011, -2.4900}, 4.7461},
                                   {{50, 2.5, 0}, {50, 0, -2.5}, 4.3065},
                                   {{50, 2.5, 0}, {73, 25, -18}, 27.1492},
                                   {{50, 2.5, 0}, {61, -5, 29}, 22.8977},
                                   {{50, 2.5, 0}, {56, -27, -3}, 31.9030},
                                   {{50, 2.5, 0}, {58, 24, 15}, 19.4535},
                                   {{50, 2.5, 0}, {50, 3.2592, 0.3350}, 1.0000},
                                   {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644},
                                   {{63.0109, -31.0961, -5.8663}, {62.8187, -29.7946, -4.0864}, 1.2630},
                                   {{61.2901, 3.7196, -5.3901}, {61.4292, 2.2480, -4.9620}, 1.8731},
                                   {{35.0831, -44.1164, 3.7933}, {35.0232, -40.0716, 1.5901}, 1.8645},
                                   {{22.7233, 20.0904, -46.6940}, {23.0331, 14.9730, -42.5619}, 2.0373},
                                   {{36.4612, 47.8580, 18.3852}, {36.2715, 50.5065, 21.2231}, 1.4146},
                                   {{90.8027, -2.0831, 1.4410}, {91.1528, -1.6435, 0.0447}, 1.4441},
                                   {{90.9257, -0.5406, -0.9208}, {88.6381, -0.8985, -0.7239}, 1.5381},
                                   {{6.7747, -0.2908, -2.4247}, {5.8714, -0.0985, -2.2286}, 0.6377},
                                   {{2.0776, 0.0795, -1.1350}, {0.9033, -0.0636, -0.5514}, 0.9082}};
  for (const auto& [one, other, difference] : pairs) {
    EXPECT_NEAR(colorDifference2000(one, other), difference, 5e-5) << one[0] << " " << one[1] << " " << one[2];
    EXPECT_NEAR(colorDifference2000(other, one), difference, 5e-5);
  }
}

TEST(ColorVision, confusesTheColorsThatReadersConfuse) {
  // Negative control: these colours are those of earlier versions, of which readers without M cones saw pairs alike.
  const Colors earlier = {{"non-manifold", {226, 0, 206}}, {"behind", {78, 124, 190}}};
  EXPECT_LT(leastDifference(earlier).difference, 10);
  EXPECT_NE(leastDifference(earlier).text.find("deuteranopia"), std::string::npos) << leastDifference(earlier).text;
  EXPECT_GT(colorDifference2000(support::seenAs({226, 0, 206}, support::visions()[0]),
                                support::seenAs({78, 124, 190}, support::visions()[0])),
            30);
  // Nobody sees a colour in greys.
  for (const support::Vision& vision : support::visions()) {
    const Lab grey = support::seenAs({128, 128, 128}, vision);
    EXPECT_LT(std::hypot(grey[1], grey[2]), 0.1) << vision.name;
    EXPECT_NEAR(grey[0], 53.585, 0.01);
  }
}

TEST(ColorSets, levelsExactLeavesAndCracksAreDistinct) {
  expectDistinct(joined({distinctLevels(), crack()}), joined({paper(), backdrop()}));
}

TEST(ColorSets, higherLevelsAreCloserButNotAlike) {
  // The levels that follow the distinct ones: each differs visibly from its neighbours and from all other levels.
  const Colors higher = levels(kDistinctLevels, kDistinctLevels + 2);
  for (const LeastDifference& least : {leastDifference(higher), leastDifference(higher, distinctLevels()),
                                       leastDifference(higher, joined({paper(), backdrop()}))})
    EXPECT_GE(least.difference, 4) << least.text;
}

TEST(ColorSets, defectsOfMeshesAreDistinct) {
  expectDistinct(joined({defects(), crack(), clay(), {{"faces from behind", kBackColor}}}),
                 joined({paper(), backdrop()}));
}

TEST(ColorSets, linesOfSlicesAreDistinct) {
  // The outlines of operands, the section of a mesh and the outline of the exact surface, which has the colour of exact
  // leaves. The field's surface is white.
  expectDistinct(joined({named("outline", outlineColors()), crack(), exact()}),
                 joined({paper(), {{"the surface", {255, 255, 255}}}}));
}

TEST(ColorSets, curvesOfLinePlotsAreDistinct) {
  expectDistinct(named("curve", kCurveColors), joined({paper(), {{"outside of the domain", kOutsideColor}}}));
}

TEST(ColorSets, colorsOfQuantitiesDifferFromPaper) {
  for (const ColorMap& map : colorMaps())
    if (map.kind == MapKind::ordered) {
      const LeastDifference least = leastDifference(named(map.name, colorsOf(map, 100)), paper());
      EXPECT_GE(least.difference, kLeast) << least.text;
    }
}

TEST(ColorSets, sidesOfDistancesDiffer) {
  for (const ColorMap& map : colorMaps()) {
    if (map.kind != MapKind::diverging) continue;
    const std::vector<Color> colors = colorsOf(map, 5);
    const LeastDifference least =
        leastDifference(named(map.name, std::vector{colors[0], colors[1], colors[3], colors[4]}));
    EXPECT_GE(least.difference, kLeast) << least.text;
  }
}

}  // namespace color_sets_test
}  // namespace hpsdf::render
