// Vector pictures: their shapes beside the pixels of the same picture, and their SVG and PDF files.
#include "hpsdf/render/vector_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/render/color_maps.h"
#include "hpsdf/render/picture.h"
#include "image/color.h"
#include "support/random_field.h"
#include "vector/cell_section.h"
#include "vector/contour_lines.h"
#include "vector/paths.h"

namespace vector_picture_test {

using namespace hpsdf;
using namespace hpsdf::render;

SlicePicture picture(ColorBy color, Plane plane = AxisPlane{2, 0.1}) {
  SlicePicture result;
  result.plane = plane;
  result.color = color;
  result.width = 640;
  result.height = 360;
  result.form.vectors = true;
  return result;
}

Drawn drawn(const Field& field, const SlicePicture& settings) {
  const auto renderer = makeCpuRenderer(field);
  return drawSlice(*renderer, field, settings);
}

const VectorLayer& layer(const VectorPicture& vectors, std::string_view name) {
  const auto found = std::ranges::find(vectors.layers, name, &VectorLayer::name);
  if (found == vectors.layers.end()) throw Error("the picture has no layer " + std::string(name));
  return *found;
}

/// Returns true if a point lies inside an odd number of closed lines.
bool contains(const FilledShape& shape, const Eigen::Vector2d& x) {
  bool inside = false;
  for (const Polyline& line : shape.borders)
    for (std::size_t n = 1; n < line.size(); ++n) {
      const Eigen::Vector2d &a = line[n - 1], &b = line[n];
      if ((a.y() <= x.y()) == (b.y() <= x.y())) continue;
      inside ^= x.x() < a.x() + (x.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
    }
  return inside;
}

/// Returns the colours of the areas that hold a point.
std::vector<Color> colorsAt(const VectorLayer& cells, const Eigen::Vector2d& x) {
  std::vector<Color> colors;
  for (const VectorShape& shape : cells.shapes)
    if (const auto* area = std::get_if<FilledShape>(&shape); area != nullptr && contains(*area, x))
      colors.push_back(area->color);
  return colors;
}

/// Returns true if the pixels around (x, y) show one cell, so that no line crosses the middle one.
bool isWithinCell(const ViewBuffers& buffers, int x, int y) {
  for (int dy = -2; dy <= 2; ++dy)
    for (int dx = -2; dx <= 2; ++dx) {
      const std::size_t i = std::size_t(y + dy) * buffers.width + std::size_t(x + dx);
      const std::size_t middle = std::size_t(y) * buffers.width + std::size_t(x);
      if (buffers.cell[i] != buffers.cell[middle] || (buffers.value[i] < 0) != (buffers.value[middle] < 0))
        return false;
    }
  return true;
}

TEST(VectorPicture, areasHaveTheColorsOfThePixels) {
  const Field field = randomField(7);
  std::mt19937 random(1);
  const std::vector<Plane> planes = {AxisPlane{0, 0.1}, AxisPlane{1, 0}, AxisPlane{2, -0.3},
                                     FreePlane{{0, 0, 0}, {1, 1, 0}}, FreePlane{{0.1, 0, 0.05}, {0.3, -1, 0.6}}};
  for (const Plane& plane : planes)
    for (const double zoom : {1.0, 5.0}) {
      SlicePicture settings = picture(ColorBy::degree, plane);
      settings.zoom = zoom;
      const Drawn result = drawn(field, settings);
      const VectorLayer& cells = layer(result.vectors, "cells");
      const ViewBuffers& buffers = result.buffers;
      int compared = 0, differing = 0;
      for (int n = 0; n < 4000; ++n) {
        const int x = std::uniform_int_distribution(2, buffers.width - 3)(random);
        const int y = std::uniform_int_distribution(2, buffers.height - 3)(random);
        if (!isWithinCell(buffers, x, y)) continue;
        const std::vector<Color> colors = colorsAt(cells, {x + 0.5, y + 0.5});
        ++compared;
        if (!buffers.hit(std::size_t(y) * buffers.width + std::size_t(x))) {
          differing += !colors.empty();
        } else {
          ASSERT_EQ(colors.size(), 1U) << "areas overlap or have a gap at " << x << "," << y;
          // Lines cover some of the pixels.
          differing += colors[0] != result.image.at(x, y);
        }
      }
      EXPECT_GT(compared, 500);
      EXPECT_LT(differing, compared / 20) << "plane " << plane.index() << ", zoom " << zoom;
    }
}

TEST(VectorPicture, areasStayNearTheWindowAtAnyZoom) {
  const Field field = randomField(7);
  SlicePicture settings = picture(ColorBy::degree, FreePlane{{0.1, 0, 0.05}, {0.3, -1, 0.6}});
  settings.target = Vector3(0.11, 0, 0.06);
  for (const double zoom : {1e4, 1e7, 1e10}) {
    settings.zoom = zoom;
    const Drawn result = drawn(field, settings);
    const VectorLayer& cells = layer(result.vectors, "cells");
    const ViewBuffers& buffers = result.buffers;
    for (const VectorShape& shape : cells.shapes) {
      const auto* area = std::get_if<FilledShape>(&shape);
      if (area == nullptr) continue;
      for (const Polyline& border : area->borders)
        for (const Eigen::Vector2d& x : border) EXPECT_LT(x.cwiseAbs().maxCoeff(), 20.0 * buffers.width) << zoom;
    }
    const int x = buffers.width / 2, y = buffers.height / 2;
    const std::vector<Color> colors = colorsAt(cells, {x + 0.5, y + 0.5});
    ASSERT_EQ(colors.size(), 1U) << zoom;
    EXPECT_EQ(colors[0], levelColor(buffers.degree[std::size_t(y) * buffers.width + std::size_t(x)])) << zoom;
  }
}

TEST(VectorPicture, anAreaInAnotherColorIsNoticed) {
  const Field field = randomField(7);
  Drawn result = drawn(field, picture(ColorBy::degree));
  VectorLayer cells = layer(result.vectors, "cells");
  for (VectorShape& shape : cells.shapes)
    if (auto* area = std::get_if<FilledShape>(&shape)) area->color = {1, 2, 3};
  int differing = 0;
  for (int y = 2; y < result.buffers.height - 2; ++y)
    for (const Color& color : colorsAt(cells, {200.5, y + 0.5})) differing += color != result.image.at(200, y);
  EXPECT_GT(differing, 100);
}

TEST(VectorPicture, sectionIsWholeWhereThePlaneRunsAlongFacesOfCells) {
  const Field field = randomField(3);
  const Box domain = field.domain();
  for (int axis = 0; axis < 3; ++axis)
    for (const double share : {0.0, 0.25, 0.5, 0.75}) {
      const double offset = domain.min()[axis] + share * domain.sizes()[axis];
      const SliceView view = axisSlice(domain, axis, offset, 400, 400);
      const CellSection section = cellSection(field, view, 400, 400);
      double area = 0;
      std::set<std::uint32_t> ids;
      for (const CellSection::Part& part : section.parts) {
        const Eigen::Vector2d size = part.extent.sizes();
        area += size.x() * size.y();
        EXPECT_TRUE(ids.insert(part.cell.id).second);
        Vector3 inside = part.cell.box.center();
        inside[axis] = offset;
        EXPECT_EQ(field.cellAt(inside).id, part.cell.id);
      }
      const Eigen::Vector2d whole(domain.sizes()[(axis == 0 ? 1 : 0)], domain.sizes()[(axis == 2 ? 1 : 2)]);
      const double pixel = view.right.norm() / 400;
      EXPECT_NEAR(area, whole.x() * whole.y() / (pixel * pixel), 1e-3 * area) << "axis " << axis << " at " << share;
    }
}

TEST(VectorPicture, surfaceLineLiesOnTheSurface) {
  const Field field = randomField(7);
  const SlicePicture settings = picture(ColorBy::degree);
  const Drawn result = drawn(field, settings);
  const auto& view = std::get<SliceView>(result.view);
  const std::vector<Polyline> lines = contourLines(result.buffers, 1, 0);
  ASSERT_FALSE(lines.empty());
  const double pixel = view.right.norm() / result.buffers.width;
  int points = 0, far = 0;
  for (const Polyline& line : lines)
    for (const Eigen::Vector2d& at : line) {
      const Vector3 x = view.origin + view.right * (at.x() / result.buffers.width - 0.5) +
                        view.up * (0.5 - at.y() / result.buffers.height);
      // Between cells the field may jump across the surface.
      const auto [value, gradient] = field.valueAndGradient(x);
      ++points;
      far += std::abs(value) > 0.1 * pixel * std::max(1.0, gradient.norm());
    }
  EXPECT_LT(far, points / 5) << points << " points";
}

TEST(VectorPicture, linksAreJoinedOnceEach) {
  const std::vector<Eigen::Vector2d> points = {{0, 0}, {1, 0}, {2, 0}, {2, 1}, {5, 5}, {6, 5}, {5, 6}};
  const std::vector<Link> links = {{1, 2}, {0, 1}, {3, 2}, {4, 5}, {5, 6}, {6, 4}};
  const std::vector<Polyline> lines = joinedLinks(links, points);
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].size(), 4U);
  EXPECT_EQ(simplified(lines[0], 0.01).size(), 3U);
  EXPECT_EQ(lines[1].size(), 4U);
  EXPECT_EQ(lines[1].front(), lines[1].back());
}

TEST(VectorPicture, pointsInOnePlaceHaveOneNumber) {
  PointNumbers numbers;
  EXPECT_EQ(numbers({3, 4}), 0);
  EXPECT_EQ(numbers({-3, 4}), 1);
  EXPECT_EQ(numbers({3 + 1e-9, 4 - 1e-9}), 0);
  EXPECT_EQ(numbers({3 + 1e-3, 4}), 2);
}

/// Returns the numbers of opening and closing tags of a text in XML, and throws if they do not fit.
std::vector<std::string> openedTags(const std::string& xml) {
  std::vector<std::string> opened, all;
  for (std::size_t at = xml.find('<'); at != std::string::npos; at = xml.find('<', at + 1)) {
    const std::size_t end = xml.find('>', at);
    if (end == std::string::npos) throw Error("a tag does not end");
    const std::string tag = xml.substr(at + 1, end - at - 1);
    if (tag.find('<') != std::string::npos) throw Error("a tag in a tag: " + tag);
    if (tag[0] == '/') {
      if (opened.empty() || opened.back() != tag.substr(1)) throw Error("unexpected " + tag);
      opened.pop_back();
    } else {
      const std::string name = tag.substr(0, tag.find_first_of(" /"));
      all.push_back(name);
      if (tag.back() != '/') opened.push_back(name);
    }
  }
  if (!opened.empty()) throw Error(opened.back() + " is not closed");
  return all;
}

TEST(VectorPicture, svgHoldsShapesAndTexts) {
  const Field field = randomField(7);
  SlicePicture settings = picture(ColorBy::degree);
  settings.width = 1280;
  settings.height = 720;
  const Drawn result = drawn(field, settings);
  const std::string svg = svgBytes(result.vectors);
  const std::vector<std::string> tags = openedTags(svg);
  EXPECT_EQ(tags[0], "svg");
  EXPECT_GT(std::ranges::count(tags, "path"), 10);
  EXPECT_EQ(std::ranges::count(tags, "image"), 0);
  for (const char* word : {">polynomial degree</text>", ">share of the volume</text>", "viewBox=\"0 0 1280 720\""})
    EXPECT_NE(svg.find(word), std::string::npos) << word;
  for (const Legend::Level& level : result.legend.levels)
    EXPECT_NE(svg.find(">" + std::to_string(level.level) + "</text>"), std::string::npos);
}

TEST(VectorPicture, colorsThatVaryWithinCellsArePixels) {
  const Field field = randomField(7);
  for (const ColorBy color : {ColorBy::distance, ColorBy::slope}) {
    const std::string svg = svgBytes(drawn(field, picture(color)).vectors);
    const std::vector<std::string> tags = openedTags(svg);
    EXPECT_EQ(std::ranges::count(tags, "image"), 1);
    EXPECT_NE(svg.find("data:image/png;base64,iVBORw0KGgo"), std::string::npos);
  }
}

TEST(VectorPicture, svgWritesNumbersAndTextsAsTheyAre) {
  VectorPicture vectors{100, 50, 2 * kScreenDpi};
  vectors.layers = {{"all",
                     {StrokedShape{{{{0.5, -0.25}, {10, -0.25}, {10, 3.005}, {12, 4}}}, 1.5, {255, 0, 16}, 0.5},
                      TextShape{"τ < 1 & \"−2\"\x01", 12, {1, 2}, {0, 0, 0}}}}};
  const std::string svg = svgBytes(vectors);
  EXPECT_NE(svg.find("width=\"50\" height=\"25\""), std::string::npos);  // CSS pixels, of which an inch has 96
  EXPECT_NE(svg.find("d=\"m.5-.25h9.5v3.26l2 .99\""), std::string::npos) << svg;
  EXPECT_NE(svg.find("stroke=\"#ff0010\" stroke-width=\"1.5\" stroke-opacity=\".5\""), std::string::npos) << svg;
  EXPECT_NE(svg.find(">τ &lt; 1 &amp; &quot;−2&quot;\uFFFD</text>"), std::string::npos) << svg;
}

TEST(VectorPicture, sameInputGivesTheSameBytes) {
  const Field field = randomField(7);
  for (const ColorBy color : {ColorBy::degree, ColorBy::distance}) {
    const Drawn first = drawn(field, picture(color)), second = drawn(field, picture(color));
    EXPECT_EQ(svgBytes(first.vectors), svgBytes(second.vectors));
    if (!writesPdf()) GTEST_SKIP() << "built without cairo";
    const std::string pdf = pdfBytes(first.vectors);
    EXPECT_TRUE(pdf.starts_with("%PDF"));
    EXPECT_EQ(pdf.find("CreationDate"), std::string::npos);
    EXPECT_EQ(pdf, pdfBytes(second.vectors));
  }
}

TEST(VectorPicture, pixelRatioEnlargesEverything) {
  const Field field = randomField(7);
  SlicePicture settings = picture(ColorBy::degree);
  const Drawn plain = drawn(field, settings);
  settings.form.pixelRatio = 2;
  const Drawn large = drawn(field, settings);
  EXPECT_EQ(large.image.width, 2 * plain.image.width);
  EXPECT_EQ(large.image.height, 2 * plain.image.height);
  EXPECT_EQ(large.image.dpi, 2 * kScreenDpi);
  const auto &small = layer(plain.vectors, "legend").shapes, &big = layer(large.vectors, "legend").shapes;
  ASSERT_EQ(small.size(), big.size());
  for (std::size_t n = 0; n < small.size(); ++n) {
    const auto *text = std::get_if<TextShape>(&small[n]), *enlarged = std::get_if<TextShape>(&big[n]);
    ASSERT_EQ(text == nullptr, enlarged == nullptr);
    if (text == nullptr) continue;
    EXPECT_EQ(text->text, enlarged->text);
    EXPECT_DOUBLE_EQ(2 * text->size, enlarged->size);
  }
}

TEST(VectorPicture, transparentPicturesLookTheSameOnWhite) {
  const Field field = randomField(7);
  SlicePicture settings = picture(ColorBy::degree);
  settings.form.transparent = true;
  const Drawn result = drawn(field, settings);
  const Image& image = result.image;
  ASSERT_EQ(image.alpha.size(), image.pixels.size());
  EXPECT_EQ(image.alpha.back(), 0) << "a corner shows the paper";
  const std::size_t middle = std::size_t(image.height / 2) * image.width + std::size_t(result.buffers.width / 2);
  EXPECT_EQ(image.alpha[middle], 255);
  EXPECT_EQ(image.pixels[middle], drawn(field, picture(ColorBy::degree)).image.pixels[middle]);
  EXPECT_NE(result.vectors.layers.front().name, "paper");
  EXPECT_EQ(pngBytes(image)[25], 6) << "a PNG file with alpha";
}

TEST(VectorPicture, backgroundsAreTakenOut) {
  Image white(16, 1, {255, 255, 255}), black(16, 1, {0, 0, 0});
  white.at(1, 0) = black.at(1, 0) = {10, 200, 30};
  white.at(2, 0) = {127, 127, 255};  // half covered by blue
  black.at(2, 0) = {0, 0, 128};
  const Image result = withoutBackground(white, black);
  EXPECT_EQ(result.alpha[0], 0);
  EXPECT_EQ(result.alpha[1], 255);
  EXPECT_EQ(result.at(1, 0), (Color{10, 200, 30}));
  EXPECT_EQ(result.alpha[2], 128);
  EXPECT_EQ(result.at(2, 0), (Color{0, 0, 255}));
}

TEST(VectorPicture, pngFilesHoldTheirPhysicalSize) {
  Image image(16, 16, {1, 2, 3});
  image.dpi = 300;
  const std::string bytes = pngBytes(image);
  const std::size_t at = bytes.find("pHYs");
  ASSERT_NE(at, std::string::npos);
  const auto byte = [&](std::size_t n) { return static_cast<unsigned char>(bytes[at + 4 + n]); };
  EXPECT_EQ(byte(2) * 256 + byte(3), 11811);  // pixels to a metre
  EXPECT_EQ(byte(8), 1);
}

}  // namespace vector_picture_test
