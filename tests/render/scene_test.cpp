// Tests planes, cells and arrows in pictures against references that test each pixel's ray or each edge's points alone.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <set>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/render/picture.h"
#include "picture/arrows.h"
#include "scene/cell_boxes.h"
#include "scene/cell_lines.h"
#include "scene/section.h"
#include "support/random_field.h"

namespace hpsdf::render {
namespace scene_test {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr int kWidth = 120;
constexpr int kHeight = 90;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Field testField() { return randomField(11, {.roughness = 0.05, .maxDepth = 3, .maxDegree = 4}); }

OrbitCamera orbitOf(Projection projection, double azimuth = 35, double elevation = 25) {
  return {.azimuthDegrees = azimuth, .elevationDegrees = elevation, .projection = projection};
}

Camera cameraAt(const Field& field, Projection projection, double azimuth = 35, double elevation = 25) {
  return cameraOf(orbitOf(projection, azimuth, elevation), field.domain(), kWidth, kHeight);
}

constexpr Projection kProjections[] = {Projection::perspective, Projection::orthographic};

/// The first thing that a ray meets, as found by the reference.
struct Seen {
  Shown shown = Shown::surface;
  std::uint32_t cell = kNoCell;
  double distance = kInfinity;
  Vector3 normal = Vector3::Zero();
  double margin = kInfinity;  ///< distance to the next thing behind it, or to its edge
};

/// Intersects a ray with the six faces of a box, one by one as rectangles, and updates the nearest hit and its margin.
void meetBox(const Vector3& eye, const Vector3& ray, const Box& box, const Cell& cell, Seen& nearest) {
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      if (ray[axis] * side >= 0) continue;  // the ray meets the back of this face
      const double t = ((side < 0 ? box.min() : box.max())[axis] - eye[axis]) / ray[axis];
      const Vector3 p = eye + t * ray;
      double within = kInfinity;
      for (const int k : {(axis + 1) % 3, (axis + 2) % 3})
        within = std::min({within, p[k] - box.min()[k], box.max()[k] - p[k]});
      if (t <= 0 || std::abs(within) < 1e-9) nearest.margin = std::min(nearest.margin, std::abs(within));
      if (t <= 0 || within < 0) continue;
      if (t < nearest.distance)
        nearest = {Shown::box, cell.id, t, side * Vector3::Unit(axis), nearest.distance - t};
      else
        nearest.margin = std::min(nearest.margin, t - nearest.distance);
    }
}

bool removed(const SurfaceView& view, const Vector3& p) {
  if (!view.clip) return false;
  const Vector3 towardsEye =
      view.camera.projection == Projection::perspective ? Vector3(view.camera.eye - p) : Vector3(-view.camera.forward);
  const double beyond = p[view.clip->axis] - view.clip->offset;
  return beyond * towardsEye[view.clip->axis] > 0 && std::abs(beyond) > 0;
}

/// Returns the part of a box that a clipping plane keeps.
std::optional<Box> kept(const SurfaceView& view, Box box) {
  if (!view.clip) return box;
  Vector3 above = view.clip->offset * Vector3::Ones();
  above[view.clip->axis] += 1e-3;
  const int axis = view.clip->axis;
  (removed(view, above) ? box.max() : box.min())[axis] =
      std::clamp(view.clip->offset, box.min()[axis], box.max()[axis]);
  if (box.min()[axis] == box.max()[axis]) return std::nullopt;
  return box;
}

TEST(ChosenCells, atTheSurfaceAreThoseThatItCrosses) {
  const Field field = testField();
  constexpr double kOffset = 0.05;
  const std::vector<Cell> all = chosenCells(field, {}, kOffset);
  const std::vector<Cell> kept = chosenCells(field, {.atSurface = true}, kOffset);
  std::set<std::uint32_t> isKept;
  for (const Cell& cell : kept) isKept.insert(cell.id);
  EXPECT_GT(kept.size(), 10U);
  EXPECT_LT(kept.size(), all.size() / 2);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0, 1);
  int missed = 0;
  for (const Cell& cell : all) {
    double low = kInfinity, high = -kInfinity;
    for (int n = 0; n < 500; ++n) {
      const Vector3 t(share(random), share(random), share(random));
      const double value = field.value(cell.box.min() + t.cwiseProduct(cell.box.sizes()));
      low = std::min(low, value);
      high = std::max(high, value);
    }
    const bool crosses = low < kOffset && high > kOffset;
    missed += crosses && !isKept.contains(cell.id);
    EXPECT_TRUE(crosses || !isKept.contains(cell.id) ||
                std::min(std::abs(low - kOffset), std::abs(high - kOffset)) < 0.05)
        << cell.id;
  }
  EXPECT_LE(missed, int(kept.size()) / 20) << "the points of a cell find nearly every crossing";
}

TEST(Scene, showsTheNearestOfSurfacePlaneAndBoxesInEachPixel) {
  const Field field = testField();
  const auto cpu = makeCpuRenderer(field);
  const ShownCells choice{CellStyle::boxes, {2, 4}, {1, 2}};
  const std::vector<Cell> cells = chosenCells(field, choice, 0);
  ASSERT_GT(cells.size(), 10u);
  std::map<Shown, int> seen;
  for (const Projection projection : kProjections)
    for (const std::optional<ClipPlane> clip : {std::optional<ClipPlane>(), {ClipPlane{0, 0.2}}})
      for (const bool oblique : {false, true}) {
        const SurfaceView view{cameraAt(field, projection), 0, clip};
        const Vector3 normal = oblique ? Vector3(1, 2, 3).normalized() : Vector3::UnitZ();
        const Vector3 point(0.05, 0.1, 0.25);
        const SliceView plane =
            oblique ? planeSlice(field.domain(), point, normal, 8, 8) : axisSlice(field.domain(), 2, point.z(), 8, 8);
        ViewBuffers buffers = cpu->surface(view, kWidth, kHeight);
        addSection(field, view, buffers);
        const ViewBuffers surface = buffers;
        addPlane(field, view, plane, buffers);
        addBoxes(field, view, cells, buffers);
        int unsure = 0;
        for (int y = 0; y < kHeight; ++y)
          for (int x = 0; x < kWidth; ++x) {
            const std::size_t i = std::size_t(y) * kWidth + x;
            const Vector3 eye = pixelEye(view.camera, x, y, kWidth, kHeight);
            const Vector3 ray = pixelRay(view.camera, x, y, kWidth, kHeight);
            Seen expected;
            if (surface.hit(i)) {
              const bool section = surface.shows(i, Shown::section);
              expected = {section ? Shown::section : Shown::surface, surface.cell[i], surface.distance[i],
                          surface.normal[i].cast<double>()};
            }
            const double toPlane = normal.dot(point - eye) / normal.dot(ray);
            Vector3 onPlane = eye + toPlane * ray;
            if (!oblique) onPlane.z() = point.z();
            if (toPlane > 0 && field.domain().contains(onPlane) && !removed(view, onPlane)) {
              const double ahead = expected.distance - toPlane;
              if (ahead > 0)
                expected = {Shown::plane, field.cellAt(onPlane).id, toPlane,
                            normal.dot(ray) < 0 ? normal : Vector3(-normal), ahead};
              else
                expected.margin = std::min(expected.margin, -ahead);
            }
            for (const Cell& cell : cells) {
              const Vector3 half = 0.4 * cell.box.sizes();
              if (const auto box = kept(view, Box(cell.box.center() - half, cell.box.center() + half)))
                meetBox(eye, ray, *box, cell, expected);
            }
            if (expected.margin < 1e-6) {
              ++unsure;
              continue;
            }
            ASSERT_EQ(buffers.cell[i], expected.cell) << x << "," << y;
            if (expected.cell == kNoCell) continue;
            ASSERT_EQ(buffers.shown[i], expected.shown) << x << "," << y;
            ++seen[expected.shown];
            const Vector3 p = eye + expected.distance * ray;
            const Cell cell = field.cellAt(expected.shown == Shown::plane ? onPlane : p);
            EXPECT_NEAR(buffers.distance[i], expected.distance, 1e-6 * expected.distance);
            EXPECT_LT((buffers.normal[i].cast<double>() - expected.normal).norm(), 1e-6);
            if (expected.shown == Shown::surface || expected.shown == Shown::section) continue;
            ASSERT_EQ(cell.id, expected.cell);
            EXPECT_EQ(buffers.degree[i], cell.degree);
            EXPECT_EQ(buffers.depth[i], cell.depth);
            EXPECT_NEAR(buffers.value[i], field.value(expected.shown == Shown::plane ? onPlane : p), 1e-5);
            EXPECT_EQ(buffers.crack[i], 0);
          }
        EXPECT_LT(unsure, 20);  // at edges, and where the clipping plane cuts both a box and the solid
      }
  for (const Shown shown : {Shown::surface, Shown::section, Shown::plane, Shown::box})
    EXPECT_GT(seen[shown], 500) << int(shown);
}

TEST(Scene, showsOnlyTheChosenCells) {
  const Field field = testField();
  const auto cells = [&](std::vector<int> degrees, std::vector<int> depths) {
    return chosenCells(field, {CellStyle::boxes, std::move(degrees), std::move(depths)}, 0);
  };
  EXPECT_EQ(cells({}, {}).size(), statistics(field).leaves);
  EXPECT_EQ(cells({3}, {}).size(), statistics(field).degreeLeaves.at(3));
  EXPECT_EQ(cells({}, {0, 2}).size(), statistics(field).depthLeaves.at(0) + statistics(field).depthLeaves.at(2));
  for (const Cell& cell : cells({1, 3}, {2})) {
    EXPECT_TRUE(cell.degree == 1 || cell.degree == 3);
    EXPECT_EQ(cell.depth, 2);
  }
  EXPECT_TRUE(cells({7}, {}).empty());
}

TEST(Scene, omitsABoxThatContainsTheEye) {
  const Field field = testField();
  const std::vector<Cell> cells = chosenCells(field, {}, 0);
  Camera camera = cameraAt(field, Projection::perspective);
  camera.eye = cells.back().box.center();
  ViewBuffers buffers = makeCpuRenderer(field)->surface({camera, 50}, kWidth, kHeight);
  addBoxes(field, {camera, 50}, cells, buffers);
  int seen = 0;
  for (std::size_t i = 0; i < buffers.cell.size(); ++i) {
    EXPECT_NE(buffers.cell[i], cells.back().id);
    seen += buffers.hit(i);
  }
  EXPECT_GT(seen, 1000);
}

/// Visits points along the edges of a box, at small distances.
template <typename Visit>
void alongEdges(const Box& box, const Visit& visit) {
  for (int i = 0; i < 8; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      if (i >> axis & 1) continue;
      const Vector3 a = box.corner(static_cast<Box::CornerType>(i));
      for (int n = 0; n <= 400; ++n) visit(Vector3(a + n / 400.0 * box.sizes()[axis] * Vector3::Unit(axis)));
    }
}

TEST(CellLines, followTheEdgesThatNothingHides) {
  const Field field = testField();
  const auto cpu = makeCpuRenderer(field);
  const std::vector<Cell> cells = chosenCells(field, {CellStyle::lines, {}, {0, 1}}, 0);
  for (const Projection projection : kProjections)
    for (const std::optional<ClipPlane> clip : {std::optional<ClipPlane>(), {ClipPlane{2, 0.1}}}) {
      const SurfaceView view{cameraAt(field, projection), 0, clip};
      ViewBuffers buffers = cpu->surface(view, kWidth, kHeight);
      addPlane(field, view, axisSlice(field.domain(), 0, -0.3, 8, 8), buffers);
      const std::vector<float> lines = cellLines(field, view, cells, buffers, 1, 0);
      std::vector<char> allowed(lines.size(), 0), wanted(lines.size(), 0);
      int hidden = 0;
      for (const Cell& cell : cells)
        if (const auto box = kept(view, cell.box))
          alongEdges(*box, [&](const Vector3& p) {
            const PicturePoint at = project(view.camera, p, kWidth, kHeight);
            const int x = int(std::floor(at.x)), y = int(std::floor(at.y));
            if (x < 1 || y < 1 || x + 1 >= kWidth || y + 1 >= kHeight) return;
            const double pixel = pixelSize(view.camera, at.depth, kHeight);
            const auto ahead = [&](int u, int v) {  // distance from p to what the picture shows there
              const std::size_t i = std::size_t(v) * kWidth + u;
              return buffers.hit(i) ? buffers.distance[i] - at.distance : kInfinity;
            };
            double most = -kInfinity;
            for (int v = y - 1; v <= y + 1; ++v)
              for (int u = x - 1; u <= x + 1; ++u) {
                most = std::max(most, ahead(u, v));
                if (ahead(u, v) > -4 * pixel) allowed[std::size_t(v) * kWidth + u] = 1;
              }
            if (std::hypot(at.x - x - 0.5, at.y - y - 0.5) < 0.4 && ahead(x, y) > 10 * pixel)
              wanted[std::size_t(y) * kWidth + x] = 1;
            hidden += most < -4 * pixel;
          });
      int drawn = 0;
      for (int y = 2; y < kHeight - 2; ++y)
        for (int x = 2; x < kWidth - 2; ++x) {
          const std::size_t i = std::size_t(y) * kWidth + x;
          EXPECT_TRUE(!wanted[i] || lines[i] > 0) << x << "," << y;
          EXPECT_TRUE(allowed[i] || lines[i] == 0) << x << "," << y << " is hidden, or no edge";
          drawn += lines[i] > 0;
        }
      EXPECT_GT(drawn, 500);
      EXPECT_GT(hidden, 500);
    }
}

TEST(CellLines, fadeForSmallCellsAndAreStrongestForTheNearest) {
  const Field field = testField();
  const SurfaceView view{cameraAt(field, Projection::perspective)};
  ViewBuffers empty = makeCpuRenderer(field)->surface({view.camera, 50}, kWidth, kHeight);
  const auto strongest = [&](int depth, double width) {
    const std::vector<float> lines =
        cellLines(field, view, chosenCells(field, {CellStyle::lines, {}, {depth}}, 0), empty, width, 0);
    return *std::ranges::max_element(lines);
  };
  EXPECT_GT(strongest(0, 1), 0.6F);
  EXPECT_GT(strongest(0, 1), strongest(3, 1));
  EXPECT_GT(strongest(3, 1), 0.0F);
  EXPECT_EQ(strongest(3, 3), 0.0F);
}

TEST(Scene, isTheSameForAnyNumberOfThreads) {
  const Field field = testField();
  const auto cpu = makeCpuRenderer(field);
  SurfacePicture picture;
  picture.width = 240;
  picture.height = 160;
  picture.plane = AxisPlane{2, 0.1};
  picture.arrows = 16;
  for (const CellStyle style : {CellStyle::lines, CellStyle::boxes}) {
    picture.cells = {style, {}, {1, 2}};
    std::vector<Color> first;
    for (const int threads : {1, 2, 5}) {
      const tbb::global_control workers(tbb::global_control::max_allowed_parallelism, threads);
      const std::vector<Color> pixels = draw(*cpu, field, picture).pixels;
      if (first.empty()) first = pixels;
      EXPECT_EQ(pixels, first) << threads << " threads";
    }
  }
}

TEST(Pick, tellsTheContentOfEachKindOfPixel) {
  const Field field = testField();
  const auto cpu = makeCpuRenderer(field);
  SurfacePicture picture;
  picture.width = 240;
  picture.height = 160;
  picture.samples = 2;
  picture.color = ColorBy::degree;
  picture.plane = FreePlane{{0, 0, 0.2}, {0, 0, 3}};
  picture.cells = {CellStyle::boxes, {2}, {}};
  for (const Projection projection : kProjections) {
    picture.camera = orbitOf(projection);
    const Drawn drawn = drawSurface(*cpu, field, picture);
    std::map<Shown, int> seen;
    for (int y = 0; y < picture.height; y += 3)
      for (int x = 0; x < picture.width; x += 3) {
        const auto pick = pickAt(field, drawn, x, y);
        if (!pick) continue;
        const std::size_t i = std::size_t(2 * y + 1) * drawn.buffers.width + (2 * x + 1);
        const Shown shown = drawn.buffers.shown[i];
        ++seen[shown];
        const Vector3 p = pick->position;
        EXPECT_TRUE(shown != Shown::plane || std::abs(p.z() - 0.2) < 2e-6);
        const Cell cell = field.cellAt(p);
        EXPECT_EQ(pick->cell, cell.id);
        EXPECT_EQ(pick->degree, cell.degree);
        EXPECT_EQ(pick->depth, cell.depth);
        EXPECT_NEAR(pick->value, field.value(p), 1e-5);
        EXPECT_TRUE(shown != Shown::box || cell.degree == 2);
      }
    EXPECT_GT(seen[Shown::plane], 100);
    EXPECT_GT(seen[Shown::box], 100);
    EXPECT_GT(seen[Shown::surface], 20);
  }
}

/// A renderer that must not be used, for pictures without a surface.
class NoRenderer : public Renderer {
 public:
  ViewBuffers slice(const SliceView&, int, int) override { throw std::logic_error("asked for a slice"); }
  ViewBuffers surface(const SurfaceView&, int, int, std::span<const std::uint8_t>) override {
    throw std::logic_error("asked for a surface");
  }
  std::string description() const override { return "none"; }
};

TEST(Scene, omitsTheSurfaceOnRequest) {
  const Field field = testField();
  NoRenderer none;
  SurfacePicture picture;
  picture.width = 240;
  picture.height = 160;
  picture.surface = false;
  EXPECT_FALSE(drawSurface(none, field, picture).seen);
  picture.cells.style = CellStyle::lines;
  const Drawn lines = drawSurface(none, field, picture);
  EXPECT_TRUE(lines.seen);
  EXPECT_FALSE(pickAt(field, lines, 100, 60)) << "lines are over what is picked";
  picture.cells.style = CellStyle::boxes;
  EXPECT_TRUE(drawSurface(none, field, picture).seen);
  EXPECT_THROW(picture.surface = true; drawSurface(none, field, picture), std::logic_error);
}

TEST(Scene, showsAPlaneInTheColorsOfItsCellsAndTheSurfaceAsALine) {
  const Field field = testField();
  NoRenderer none;
  SurfacePicture picture;
  picture.width = 400;
  picture.height = 300;
  picture.samples = 3;
  picture.surface = false;
  picture.bare = true;
  picture.color = ColorBy::degree;
  picture.camera = {.azimuthDegrees = 0, .elevationDegrees = 0};
  picture.plane = AxisPlane{2, 0.1};
  const Drawn drawn = drawSurface(none, field, picture);
  std::map<int, Color> colors;
  for (const Legend::Level& level : drawn.legend.levels) colors[level.level] = level.color;
  int same = 0, pixels = 0, onLine = 0, light = 0;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const auto pick = pickAt(field, drawn, x, y);
      if (!pick) continue;
      ++pixels;
      same += drawn.image.at(x, y) == colors.at(pick->degree);
      if (std::abs(pick->value) > 0.001) continue;
      ++onLine;
      light += drawn.image.at(x, y)[0] > 200;
    }
  EXPECT_GT(pixels, 30000);
  EXPECT_GT(same, 0.7 * pixels);
  EXPECT_LT(same, 0.98 * pixels) << "no outlines";
  EXPECT_GT(onLine, 50);
  EXPECT_GT(light, 0.9 * onLine);
}

TEST(Scene, rejectsSettingsThatCannotBeDrawn) {
  const Field field = testField();
  NoRenderer none;
  const auto drawing = [&](auto change) {
    SurfacePicture picture;
    picture.surface = false;
    change(picture);
    return [=, &field, &none] { drawSurface(none, field, picture); };
  };
  EXPECT_THAT(drawing([](auto& p) { p.plane = AxisPlane{1, 3}; }), ThrowsMessage<Error>(HasSubstr("outside")));
  EXPECT_THAT(drawing([](auto& p) {
                p.plane = FreePlane{{5, 5, 5}, {1, 1, 1}};
              }),
              ThrowsMessage<Error>(HasSubstr("misses the domain")));
  EXPECT_THAT(drawing([](auto& p) { p.arrows = 3; }), ThrowsMessage<Error>(HasSubstr("arrows = 3")));
  EXPECT_THAT(drawing([](auto& p) { p.arrows = -8; }), ThrowsMessage<Error>(HasSubstr("arrows = -8")));
  EXPECT_THAT(drawing([](auto& p) { p.clip = ClipPlane{0, kInfinity}; }), ThrowsMessage<Error>(HasSubstr("clipping")));
}

TEST(Arrows, followTheProjectionOfTheGradientInASlice) {
  const Field field = testField();
  const auto cpu = makeCpuRenderer(field);
  const SliceView view = planeSlice(field.domain(), {0.1, 0, 0}, {1, 0.5, 2}, kWidth, kHeight);
  for (const int samples : {1, 3}) {
    const ViewBuffers buffers = cpu->slice(view, samples * kWidth, samples * kHeight);
    const std::vector<Arrow> arrows = gradientArrows(field, view, buffers, samples, 10);
    EXPECT_GT(arrows.size(), 30u);
    int whole = 0;
    for (const Arrow& arrow : arrows) {
      const Eigen::Vector2d middle = 0.5 * (arrow.from + arrow.to), along = arrow.to - arrow.from;
      EXPECT_NEAR(std::remainder(middle.x() - 5.5, 10), 0, 1e-9);
      EXPECT_NEAR(std::remainder(middle.y() - 5.5, 10), 0, 1e-9);
      const Vector3 p = view.origin + view.right * (middle.x() / kWidth - 0.5) + view.up * (0.5 - middle.y() / kHeight);
      const Vector3 gradient = field.valueAndGradient(p).gradient;
      const Vector3 normal = view.right.cross(view.up).normalized();
      const Vector3 inPlane = gradient - normal.dot(gradient) * normal;
      const Vector3 shown = along.x() * view.right.normalized() - along.y() * view.up.normalized();
      EXPECT_LT(shown.normalized().cross(inPlane.normalized()).norm(), 1e-6);
      EXPECT_GT(shown.dot(inPlane), 0);
      EXPECT_NEAR(along.norm(), std::min(10.0, 8 * inPlane.norm()), 1e-6);
      whole += along.norm() > 7;
    }
    EXPECT_GT(whole, 5);
  }
}

TEST(Arrows, startAtTheVisiblePointOfASurfaceAndFollowTheGradient) {
  const Field field = testField();
  const auto cpu = makeCpuRenderer(field);
  for (const Projection projection : kProjections) {
    const SurfaceView view{cameraAt(field, projection)};
    const ViewBuffers buffers = cpu->surface(view, kWidth, kHeight);
    const std::vector<Arrow> arrows = gradientArrows(field, view, buffers, 1, 8);
    EXPECT_GT(arrows.size(), 20u);
    for (const Arrow& arrow : arrows) {
      const int x = int(arrow.from.x()), y = int(arrow.from.y());
      EXPECT_NEAR(arrow.from.x(), x + 0.5, 1e-4);
      EXPECT_NEAR(arrow.from.y(), y + 0.5, 1e-4);
      const Vector3 p = pointAt(view, buffers, x, y);
      const double pixel = pixelSize(view.camera, (p - view.camera.eye).dot(view.camera.forward), kHeight);
      const Vector3 gradient = field.valueAndGradient(p).gradient;
      const Vector3 end = p + std::min(8.0, 6.4 * gradient.norm()) * pixel * gradient.normalized();
      const PicturePoint to = project(view.camera, end, kWidth, kHeight);
      EXPECT_NEAR(arrow.to.x(), to.x, 1e-6);
      EXPECT_NEAR(arrow.to.y(), to.y, 1e-6);
    }
  }
}

TEST(Arrows, areFaintWhereSomethingIsNearer) {
  const Field field = testField();
  const SurfaceView view{cameraAt(field, Projection::perspective)};
  ViewBuffers buffers = makeCpuRenderer(field)->surface(view, kWidth, kHeight);
  for (float& distance : buffers.distance) distance *= 1.05F;
  const std::vector<Arrow> arrows = gradientArrows(field, view, buffers, 1, 8);
  for (float& distance : buffers.distance) distance /= 1.05F * 1.05F;
  for (const Arrow& arrow : arrows) {
    const int x = int(arrow.from.x()), y = int(arrow.from.y());
    EXPECT_LT(arrow.strength(0, x, y), 0.5F);
  }
  for (float& distance : buffers.distance) distance *= 1.2F;
  for (const Arrow& arrow : arrows) EXPECT_EQ(arrow.strength(0, int(arrow.from.x()), int(arrow.from.y())), 1.0F);
}

TEST(Arrows, areDarkInALightCasingAndStayWithinTheirRectangle) {
  for (const Color ground : {Color{20, 10, 40}, Color{250, 250, 250}, Color{60, 160, 90}}) {
    Image image(100, 60, ground);
    paintArrows(image, {0, 0, 100, 40}, {{{20, 20}, {60, 20}}, {{50, 30}, {50, 55}}}, 2);
    const Color core = image.at(35, 20);
    EXPECT_LT(core[0] + core[1] + core[2], 120);
    int lightest = 0;
    for (int y = 14; y < 20; ++y) lightest = std::max(lightest, image.at(35, y)[0] + image.at(35, y)[1]);
    EXPECT_GT(lightest, 350);
    const auto darkWidth = [&](int x) {
      int width = 0;
      for (int y = 5; y < 35; ++y) width += image.at(x, y)[0] + image.at(x, y)[1] + image.at(x, y)[2] < 150;
      return ground[0] < 50 ? 99 : width;
    };
    EXPECT_GT(darkWidth(52), darkWidth(25) + (ground[0] < 50 ? -1 : 2)) << "no head at the end";
    for (int y = 40; y < 60; ++y)
      for (int x = 0; x < 100; ++x) EXPECT_EQ(image.at(x, y), ground);
  }
}

}  // namespace scene_test
}  // namespace hpsdf::render
