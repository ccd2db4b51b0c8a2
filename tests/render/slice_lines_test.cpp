// Tests the lines over slices, and the edges of meshes over surfaces, against circles and boxes.
#include "picture/slice_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "expect_tidy.h"
#include "hpsdf/build.h"
#include "hpsdf/render/picture.h"
#include "hpsdf/shapes.h"
#include "scene/mesh_lines.h"
#include "view/view_buffers.h"

namespace hpsdf::render {
namespace slice_lines_test {

constexpr int kWidth = 160, kHeight = 120;
const PixelRect kWhole = {0, 0, kWidth, kHeight};
const Box kDomain(Vector3::Constant(-1), Vector3::Constant(1));

DistanceFunction sphere(double radius, const Vector3& center = Vector3::Zero()) {
  return DistanceFunction([=](const Vector3& x) { return (x - center).norm() - radius; });
}

Field sphereField() { return build(sphere(0.6), kDomain, {.targetError = 1e-8, .grid = {4, 4, 4}}); }

double lengthOf(const std::vector<FlatLine>& lines) {
  double length = 0;
  for (const FlatLine& line : lines) length += (line.to - line.from).norm();
  return length;
}

TEST(Outline, isTheCircleInWhichAPlaneCutsASphere) {
  const SliceView view = axisSlice(kDomain, 2, 0.2, kWidth, kHeight);
  const double pixels = kWidth / view.right.norm(), radius = pixels * std::sqrt(0.6 * 0.6 - 0.2 * 0.2);
  const std::vector<FlatLine> lines = outlineOf(sphere(0.6), view, kWhole, kWidth, kHeight);
  for (const FlatLine& line : lines)
    for (const Eigen::Vector2d& end : {line.from, line.to})
      EXPECT_NEAR((end - Eigen::Vector2d(kWidth / 2.0, kHeight / 2.0)).norm(), radius, 0.02);
  EXPECT_NEAR(lengthOf(lines), 2 * std::numbers::pi * radius, 0.2);

  // A part of the view has a part of the circle.
  const PixelRect left = {0, 0, kWidth / 2, kHeight};
  const std::vector<FlatLine> half = outlineOf(sphere(0.6), view, left, kWidth, kHeight);
  EXPECT_NEAR(lengthOf(half), std::numbers::pi * radius, 2);
  for (const FlatLine& line : half) EXPECT_LE(std::max(line.from.x(), line.to.x()), kWidth / 2.0);

  // A bound of the distance has the same outline.
  const DistanceFunction bound([](const Vector3& x) { return 0.4 * (x.norm() - 0.6); });
  EXPECT_NEAR(lengthOf(outlineOf(bound, view, kWhole, kWidth, kHeight)), lengthOf(lines), 1e-6);
}

TEST(Section, ofABoxIsARectangle) {
  const SliceView view = axisSlice(kDomain, 1, 0.1, kWidth, kHeight);
  const double pixels = kWidth / view.right.norm();
  const std::vector<FlatLine> lines = sectionOf(shapes::mesh("box,width=1,height=1,depth=0.5"), view, kWidth, kHeight);
  EXPECT_NEAR(lengthOf(lines), pixels * 2 * (1 + 0.5), 1e-6);
  for (const FlatLine& line : lines)
    for (const Eigen::Vector2d& end : {line.from, line.to}) {
      const Eigen::Vector2d at = (end - Eigen::Vector2d(kWidth / 2.0, kHeight / 2.0)).cwiseAbs() / pixels;
      EXPECT_NEAR(std::max(at.x() / 0.5, at.y() / 0.25), 1, 1e-9);
    }
  EXPECT_TRUE(sectionOf(shapes::mesh("box,width=1,height=0.1,depth=1"), view, kWidth, kHeight).empty());
}

/// Returns how many pixels of a slice have the colour of the first outline.
std::ptrdiff_t outlinePixels(const Field& field, const std::vector<OutlinedSolid>& solids) {
  const auto renderer = makeCpuRenderer(field);
  const SlicePicture picture{.color = ColorBy::distance, .width = 320, .height = 240, .bare = true};
  return std::ranges::count(draw(*renderer, field, picture, {.outlined = solids}).pixels, outlineColor(0));
}

TEST(Outline, isDashedWhereTheFieldHasNoSurface) {
  const Field field = sphereField();
  const auto pixels = [&](const DistanceFunction& solid) {
    return double(outlinePixels(field, {{"solid", std::make_shared<const DistanceFunction>(solid)}}));
  };
  EXPECT_EQ(outlinePixels(field, {}), 0);
  const double onSurface = pixels(sphere(0.6)), apart = pixels(sphere(0.5)) * 0.6 / 0.5;
  EXPECT_GT(onSurface, 300);
  EXPECT_LT(apart, 0.75 * onSurface);
  EXPECT_GT(apart, 0.25 * onSurface);
}

TEST(Outline, isNotDrawnWhereTheViewMissesTheDomain) {
  const Field field = sphereField();
  const auto renderer = makeCpuRenderer(field);
  const TriangleMesh mesh = shapes::mesh("sphere,radius=0.6");
  const std::vector<OutlinedSolid> solids = {{"solid", std::make_shared<const DistanceFunction>(sphere(0.5))}};
  SlicePicture picture{.width = 320, .height = 240, .zoom = 10, .target = Vector3(5, 5, 0)};
  const Drawn drawn = drawSlice(*renderer, field, picture, {.mesh = {&mesh, 1e-3}, .outlined = solids});
  EXPECT_FALSE(drawn.seen);
  EXPECT_EQ(drawn.legend.lines.size(), 2U);
  picture.bare = true;
  EXPECT_EQ(draw(*renderer, field, picture, {.mesh = {&mesh, 1e-3}, .outlined = solids}).pixels,
            draw(*renderer, field, picture).pixels);
}

TEST(LineLegend, isTidyAndLeavesRoomForTheColours) {
  std::vector<Legend::Line> lines;
  for (std::size_t n = 0; n < 12; ++n) lines.push_back({"move(a long name.obj, 0.5, 0, 0)", outlineColor(n)});
  for (const auto& [width, height] : {std::pair{200, 140}, {320, 240}, {640, 360}, {1280, 720}, {2000, 200}}) {
    const std::string size = std::to_string(width) + "x" + std::to_string(height);
    Frame f = frame(width, height);
    const PixelRect panel = f.panel;
    Overlay overlay;
    addLineLegend(overlay, f, lines);
    EXPECT_GE(f.panel.height(), panel.height() / 2) << size;
    addDistanceBar(overlay, f, distanceScale(-0.3, 1), colorMap(MapKind::diverging, ""));
    f.panel = panel;
    expectTidy(overlay, f, size);
  }
}

TEST(Outlines, takeTheirColoursInTurn) {
  const std::size_t count = outlineColors().size();
  for (std::size_t n = 0; n < 3 * count; ++n) EXPECT_EQ(outlineColor(n), outlineColors()[n % count]) << n;
}

/// Returns how much of the view lines of the mesh cover, in pixels, over a picture of the field's surface.
double covered(const TriangleMesh& mesh, const SurfaceView& view, const ViewBuffers& buffers) {
  const std::vector<float> coverage = meshLines(mesh, 1e-3, kDomain, view, buffers, 1);
  double sum = 0;
  for (const float share : coverage) sum += share;
  return sum;
}

TEST(MeshLines, showTheTrianglesThatTheSurfaceDoesNotHide) {
  const Field field = sphereField();
  const Camera camera = cameraOf({.azimuthDegrees = 0, .elevationDegrees = 0}, kDomain, kWidth, kHeight);
  const SurfaceView view{camera};
  const ViewBuffers buffers = makeCpuRenderer(field)->surface(view, kWidth, kHeight);
  const TriangleMesh mesh = shapes::mesh("sphere,radius=0.6");
  const double whole = covered(mesh, view, buffers);
  EXPECT_GT(whole, 500);

  // The camera looks along −z. Triangles behind the middle are hidden, also if they are turned over to face the eye.
  TriangleMesh front = mesh, back = mesh;
  const auto depth = [&](const Triangle& t) { return mesh.vertices[t[0]].z() + mesh.vertices[t[1]].z(); };
  std::erase_if(front.triangles, [&](const Triangle& t) { return depth(t) < 0.2; });
  std::erase_if(back.triangles, [&](const Triangle& t) { return depth(t) > -0.2; });
  EXPECT_GT(covered(front, view, buffers), 0.5 * whole);
  EXPECT_EQ(covered(back, view, buffers), 0);
  for (Triangle& triangle : back.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_EQ(covered(back, view, buffers), 0);
  EXPECT_GT(covered(back, view, emptyBuffers(kWidth, kHeight, true)), 100) << "nothing hides them here";

  // A clipping plane removes what is on the eye's side.
  EXPECT_EQ(covered(front, {camera, 0, ClipPlane{2, 0}}, buffers), 0);
  const double upper = covered(front, {camera, 0, ClipPlane{2, 0.4}}, buffers);
  EXPECT_GT(upper, 0);
  EXPECT_LT(upper, 0.9 * covered(front, view, buffers));
}

}  // namespace slice_lines_test
}  // namespace hpsdf::render
