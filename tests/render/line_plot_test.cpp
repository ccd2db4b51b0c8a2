#include "hpsdf/render/line_plot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "coloring/color_view.h"
#include "expect_tidy.h"
#include "hpsdf/error.h"
#include "picture/line_layout.h"
#include "support/random_field.h"

namespace hpsdf::render {
namespace line_plot_test {

/// Makes a field of two cells with degrees 0 and 1, whose value is 0 for x < 0 and 1 otherwise.
Field stepField() {
  FieldData data;
  data.domain = Box(Vector3(-1, 0, 0), Vector3(1, 1, 1));
  data.grid = {2, 1, 1};
  data.nodes = {node::leaf(0, 0), node::leaf(1, 1)};
  data.coefficients = std::vector<double>{0, 1, 0, 0, 0};
  data.metadata.source.name = "step";
  return Field(std::move(data));
}

std::vector<double> exactAlong(const Line& line) {
  std::vector<double> exact;
  for (const LineSample& sample : line.samples) exact.push_back(sample.point.norm() - 0.6);
  return exact;
}

std::set<std::string> textsOf(const LineLayout& layout) {
  std::set<std::string> texts;
  for (const TextItem& item : layout.overlay.texts) texts.insert(item.text);
  return texts;
}

TEST(LinePlot, showsAJumpAsAnUprightStepInItsPlace) {
  const Field field = stepField();
  const Line line = sampleLine(field, {-1, 0.5, 0.5}, {1, 0.5, 0.5}, 20);
  const LineLayout layout = layOutLine(frame(1280, 720), field, line, {});
  ASSERT_EQ(layout.charts.size(), 3u);
  const PixelRect& chart = layout.charts[0];
  const double middle = 0.5 * (chart.x0 + chart.x1);
  const CurveItem& f = layout.curves[0];
  EXPECT_EQ(f.within, chart);
  int steps = 0;
  for (std::size_t i = 1; i < f.points.size(); ++i) {
    const Eigen::Vector2d &a = f.points[i - 1], &b = f.points[i];
    EXPECT_TRUE(a.y() == b.y() || a.x() == b.x());
    if (a.y() == b.y()) continue;
    ++steps;
    EXPECT_NEAR(a.x(), middle, 1e-9);
    EXPECT_GT(a.y() - b.y(), 0.8 * chart.height()) << "upwards";
  }
  EXPECT_EQ(steps, 1);
  // Without an exact distance, the second chart shows the jump.
  const CurveItem& stem = layout.curves[1];
  EXPECT_EQ(stem.within, layout.charts[1]);
  ASSERT_EQ(stem.points.size(), 2u);
  EXPECT_NEAR(stem.points[1].x(), middle, 1e-9);
  EXPECT_GT(stem.points[0].y() - stem.points[1].y(), 0.8 * layout.charts[1].height());
}

TEST(LinePlot, hasEachNumberAtItsLevel) {
  const Field field = stepField();
  const Line line = sampleLine(field, {-1, 0.5, 0.5}, {1, 0.5, 0.5}, 20);
  const LineLayout layout = layOutLine(frame(1280, 720), field, line, {});
  const PixelRect& chart = layout.charts[0];
  const auto rowOf = [&](const std::string& text) {
    for (const TextItem& item : layout.overlay.texts) {
      const double row = item.baseline - capHeight(item.size) / 2;
      if (item.text == text && item.x < chart.x0 && row > chart.y0 && row < chart.y1) return row;
    }
    ADD_FAILURE() << "no " << text;
    return 0.0;
  };
  const auto& points = layout.curves[0].points;
  EXPECT_NEAR(rowOf("0"), points.front().y(), 1e-9);
  EXPECT_NEAR(rowOf("1"), points.back().y(), 1e-9);
}

TEST(LinePlot, hasBandsInTheColorsOfTheFieldsLevels) {
  const Field field = stepField();
  const Line line = sampleLine(field, {-1.5, 0.5, 0.5}, {1, 0.5, 0.5}, 20);
  const Image image = drawLine(field, line, {}, 1280, 720).image;
  const LineLayout layout = layOutLine(frame(1280, 720), field, line, {});
  const PixelRect& last = layout.charts.back();
  const auto at = [&](double t) { return last.x0 + int(t * last.width()); };
  const int y = last.y1 + 20;  // within the band of degree colours, but not on a number
  EXPECT_EQ(image.at(at(0.3), y), levelColor(0));
  EXPECT_EQ(image.at(at(0.7), y), levelColor(1));
  EXPECT_NE(image.at(at(0.1), y), levelColor(0)) << "outside of the domain";
  EXPECT_NE(image.at(at(0.1), y), paperColor());
}

TEST(LinePlot, showsTheExactDistanceAndTheErrorWhereTheyAreKnown) {
  const Field field = randomField(4);
  const Line line = sampleLine(field, {-0.9, -0.8, -0.7}, {0.9, 0.7, 0.8}, 200);
  const LineLayout with = layOutLine(frame(1280, 720), field, line, exactAlong(line));
  const LineLayout without = layOutLine(frame(1280, 720), field, line, {});
  EXPECT_EQ(with.curves.size(), 5u);
  const std::set<std::string> texts = textsOf(with), others = textsOf(without);
  for (const char* name : {"signed distance", "field f", "exact", "error f − exact", "gradient", "|∇f|", "degree",
                           "depth", "slope along line"})
    EXPECT_TRUE(texts.contains(name)) << name;
  EXPECT_FALSE(others.contains("exact"));
  EXPECT_TRUE(others.contains("jump of f at borders"));
  EXPECT_NE(drawLine(field, line, exactAlong(line), 640, 360).image.pixels,
            drawLine(field, line, {}, 640, 360).image.pixels);
}

TEST(LinePlot, clipsAndOverlapsNothingAtAnySize) {
  RandomFieldOptions large;
  large.domain = Box(Vector3::Constant(-3e5), Vector3::Constant(2e5));
  large.radius = 1e5;
  large.maxDegree = 20;
  RandomFieldOptions small;
  small.domain = Box(Vector3::Constant(-3e-7), Vector3::Constant(2e-7));
  small.radius = 1e-7;
  small.maxDepth = 1;
  for (const Field& field : {stepField(), randomField(1), randomField(2, large), randomField(3, small)})
    for (const auto& [width, height] : {std::pair{16, 16},
                                        {64, 64},
                                        {160, 140},
                                        {200, 140},
                                        {200, 1000},
                                        {240, 2000},
                                        {320, 240},
                                        {400, 150},
                                        {640, 360},
                                        {783, 441},
                                        {1280, 720},
                                        {2000, 200},
                                        {4096, 2160},
                                        {16384, 4000}})
      for (const double share : {1.3, 0.9, 1e-4}) {
        const Vector3 center = field.domain().center() + 0.05 * field.domain().sizes();
        const Vector3 half = 0.5 * share * field.domain().sizes();
        const Line line = sampleLine(field, center - half, center + half, 100);
        const Frame f = frame(width, height);
        const std::vector<double> exact = exactAlong(line);
        for (const bool known : {true, false}) {
          const LineLayout layout = layOutLine(f, field, line, known ? exact : std::vector<double>{});
          const std::string what = std::to_string(width) + "x" + std::to_string(height);
          expectReadable(layout.overlay, f, what);
          ASSERT_FALSE(layout.charts.empty());
          for (std::size_t n = 0; n < layout.charts.size(); ++n) {
            const PixelRect& chart = layout.charts[n];
            EXPECT_TRUE(f.view.contains(chart)) << what;
            EXPECT_FALSE(chart.empty()) << what;
            EXPECT_GE(chart.width(), width / 8) << what;
            for (std::size_t k = 0; k < n; ++k) EXPECT_FALSE(chart.overlaps(layout.charts[k])) << what;
            for (const TextItem& item : layout.overlay.texts)
              EXPECT_FALSE(chart.overlaps(measureText(item.text, item.size, item.x, item.baseline).ink))
                  << what << ": \"" << item.text << "\" covers a curve";
          }
          if (width >= 640 && height >= 360) {
            EXPECT_GE(layout.charts.size(), line.pieces.size() > 1 || known ? 3u : 2u) << what;
          }
          for (const CurveItem& curve : layout.curves)
            for (const Eigen::Vector2d& point : curve.points)
              EXPECT_TRUE(point.allFinite() && point.y() > curve.within.y0 - 1 && point.y() < curve.within.y1 + 1);
        }
      }
}

TEST(LinePlot, isDrawnInEverySizeAndRejectsOthers) {
  const Field field = randomField(1);
  const Line line = sampleLine(field, {-0.9, -0.8, -0.7}, {0.9, 0.7, 0.8}, 50);
  for (const auto& [width, height] : {std::pair{16, 16}, {64, 700}, {700, 64}, {320, 240}, {1920, 1080}}) {
    const Image image = drawLine(field, line, exactAlong(line), width, height).image;
    EXPECT_EQ(image.width, width);
    EXPECT_EQ(image.height, height);
  }
  EXPECT_THROW(drawLine(field, line, {}, 15, 100), Error);
  EXPECT_THROW(drawLine(field, line, {}, 100, 16385), Error);
}

TEST(Curve, hasItsStatedWidth) {
  CurveItem curve{{{5, 10.5}, {15, 10.5}, {15, 4}, {15, 10.5}}, 3, {0, 0, 0}, {0, 0, 20, 20}};
  Image image(20, 20, {255, 255, 255});
  paintCurve(image, curve);
  for (int y = 0; y < 20; ++y) EXPECT_EQ(image.at(10, y) == (Color{0, 0, 0}), y >= 9 && y <= 11) << y;
  curve.within = {0, 0, 20, 10};
  Image cut(20, 20, {255, 255, 255});
  paintCurve(cut, curve);
  EXPECT_EQ(cut.at(10, 9), (Color{0, 0, 0}));
  EXPECT_EQ(cut.at(10, 10), (Color{255, 255, 255}));
}

}  // namespace line_plot_test
}  // namespace hpsdf::render
