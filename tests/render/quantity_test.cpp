#include "coloring/quantity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/render/picture.h"
#include "hpsdf/render/point_colors.h"
#include "image/colormap.h"
#include "support/random_field.h"

namespace hpsdf::render {
namespace quantity_test {

struct Seen {
  Field field = randomField(3, {.radius = 0.5, .roughness = 0.1});
  Jumps jumps = findJumps(field);
  DistanceFunction exact{[](const Vector3& x) { return x.norm() - 0.5; }};
  ReferenceData reference{&jumps, &exact};
};

Vector3 pointOf(const SliceView& view, int x, int y, int width, int height) {
  return view.origin + view.right * ((x + 0.5) / width - 0.5) + view.up * (0.5 - (y + 0.5) / height);
}

TEST(ColorModes, standInTheOrderOfTheirEnumerators) {
  for (std::size_t i = 0; i < colorModes().size(); ++i) EXPECT_EQ(std::size_t(colorModes()[i].color), i);
  EXPECT_EQ(colorModes().size(), std::size_t(ColorBy::cellError) + 1) << "one for each enumerator; name the last here";
}

TEST(PointColors, areThoseOfAPictureWithTheSameScale) {
  const Seen seen;
  const auto renderer = makeCpuRenderer(seen.field);
  for (const ColorBy color :
       {ColorBy::degree, ColorBy::depth, ColorBy::valueJump, ColorBy::slope, ColorBy::error, ColorBy::cellError}) {
    // A slice far from the surface, so that no line covers its colours.
    const SlicePicture picture{.plane = AxisPlane{2, 0.95}, .color = color, .width = 40, .height = 40, .bare = true};
    const Drawn drawn = drawSlice(*renderer, seen.field, picture, seen.reference);
    std::vector<Vector3> points;
    std::vector<Color> expected;
    for (int y = 0; y < 40; ++y)
      for (int x = 0; x < 40; ++x) {
        const std::size_t i = std::size_t(y) * 40 + x;
        const auto isOther = [&](std::size_t k) { return drawn.buffers.cell[k] != drawn.buffers.cell[i]; };
        if (x < 3 || y < 3 || isOther(i - 1) || isOther(i - 2) || isOther(i - 40) || isOther(i - 80)) continue;
        points.push_back(pointAt(std::get<SliceView>(drawn.view), drawn.buffers, x, y));
        expected.push_back(drawn.image.at(x, y));
      }
    ASSERT_GT(points.size(), 50U);
    const PointColors made = pointColors(seen.field, points, color, drawn.scale, seen.reference);
    std::size_t same = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      int most = 0;
      for (int k = 0; k < 3; ++k) most = std::max(most, std::abs(made.colors[i][k] - expected[i][k]));
      same += most <= 2;
    }
    EXPECT_GT(double(same), 0.9 * double(points.size())) << "color " << int(color);
    ScaleOptions other = drawn.scale;
    if (other.limits) {
      (*other.limits)[0] *= 0.01;
      EXPECT_NE(pointColors(seen.field, points, color, other, seen.reference).colors, made.colors);
    }
  }
  EXPECT_THROW(pointColors(seen.field, {}, ColorBy::normal), Error);
  EXPECT_THROW(pointColors(seen.field, {}, ColorBy::error), Error);
}

TEST(PerCell, colorsEachCellByTheGreatestValueOfItsSamples) {
  const Seen seen;
  const auto renderer = makeCpuRenderer(seen.field);
  SlicePicture picture{.plane = AxisPlane{2, 0.95}, .color = ColorBy::error, .width = 60, .height = 60, .bare = true};
  picture.scale = {.limits = std::array{1e-3, 1.0}, .perCell = true};
  const Drawn drawn = drawSlice(*renderer, seen.field, picture, seen.reference);
  const std::vector<float> errors = quantityAt(seen.field, drawn.view, drawn.buffers, ColorBy::error, seen.reference);
  std::map<std::uint32_t, float> greatest;
  for (std::size_t i = 0; i < errors.size(); ++i)
    if (drawn.buffers.hit(i)) greatest[drawn.buffers.cell[i]] = std::max(greatest[drawn.buffers.cell[i]], errors[i]);
  const ColorScale scale(1e-3, 1, true);
  int inside = 0, raised = 0;
  for (int y = 3; y < 60; ++y)
    for (int x = 3; x < 60; ++x) {
      const std::size_t i = std::size_t(y) * 60 + x;
      const auto isOther = [&](std::size_t k) { return drawn.buffers.cell[k] != drawn.buffers.cell[i]; };
      if (!drawn.buffers.hit(i) || isOther(i - 1) || isOther(i - 2) || isOther(i - 60) || isOther(i - 120)) continue;
      const float most = greatest[drawn.buffers.cell[i]];
      ++inside;
      raised += encodeSrgb(scale(most)) != encodeSrgb(scale(errors[i]));
      EXPECT_EQ(drawn.image.at(x, y), encodeSrgb(scale(most))) << x << ", " << y;
    }
  EXPECT_GT(inside, 100);
  EXPECT_GT(raised, inside / 2) << "most samples show another value than their own";
}

TEST(Quantity, ofASliceIsThatOfItsPoints) {
  const Seen seen;
  const SliceView view = planeSlice(seen.field.domain(), {0.1, 0, 0.05}, {1, 2, 3}, 60, 40);
  const ViewBuffers buffers = makeCpuRenderer(seen.field)->slice(view, 60, 40);
  const auto at = [&](ColorBy quantity) { return quantityAt(seen.field, view, buffers, quantity, seen.reference); };
  const auto valueJump = at(ColorBy::valueJump), gradientJump = at(ColorBy::gradientJump), slope = at(ColorBy::slope),
             error = at(ColorBy::error), cellError = at(ColorBy::cellError);
  const auto worstValue = worstJumpOfCells(seen.field, seen.jumps, JumpKind::value);
  const auto worstGradient = worstJumpOfCells(seen.field, seen.jumps, JumpKind::gradient);
  int hits = 0, misses = 0;
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 60; ++x) {
      const std::size_t i = std::size_t(y) * 60 + x;
      if (!buffers.hit(i)) {
        ++misses;
        for (const auto* values : {&valueJump, &gradientJump, &slope, &error, &cellError})
          EXPECT_TRUE(std::isnan((*values)[i]));
        continue;
      }
      ++hits;
      const Vector3 point = pointOf(view, x, y, 60, 40);
      const Cell cell = seen.field.cellAt(point);
      ASSERT_EQ(cell.id, buffers.cell[i]);
      const auto [value, gradient] = seen.field.valueAndGradient(point);
      EXPECT_EQ(valueJump[i], float(worstValue[cell.id]));
      EXPECT_EQ(gradientJump[i], float(worstGradient[cell.id]));
      EXPECT_FLOAT_EQ(slope[i], float(std::abs(gradient.norm() - 1)));
      EXPECT_FLOAT_EQ(error[i], float(std::abs(value - (point.norm() - 0.5))));
      EXPECT_FLOAT_EQ(cellError[i], float(std::sqrt(cell.error / cell.box.volume())));
    }
  EXPECT_GT(hits, 500);
  EXPECT_GT(misses, 50);
}

TEST(Difference, ofTwoFieldsIsThatOfTheirValues) {
  const Field field = randomField(3, {.radius = 0.5, .roughness = 0.1});
  FieldData data = field.data();
  auto& coefficients = std::get<FieldArray<double>>(data.coefficients).values();
  for (const std::uint64_t bits : data.nodes)
    if (node::isLeaf(bits)) coefficients[node::offset(bits)] -= 0.25;
  const Field offset(std::move(data));
  const SliceView view = planeSlice(field.domain(), {0.1, 0, 0.05}, {1, 2, 3}, 60, 40);
  const ViewBuffers buffers = makeCpuRenderer(field)->slice(view, 60, 40);
  const auto same = quantityAt(field, view, buffers, ColorBy::difference, {.other = &field});
  const auto other = quantityAt(field, view, buffers, ColorBy::difference, {.other = &offset});
  int hits = 0;
  for (std::size_t i = 0; i < same.size(); ++i) {
    EXPECT_EQ(std::isnan(other[i]), !buffers.hit(i));
    if (!buffers.hit(i)) continue;
    ++hits;
    EXPECT_EQ(same[i], 0.0F);
    EXPECT_NEAR(other[i], 0.25, 1e-12);
  }
  EXPECT_GT(hits, 500);
  EXPECT_THROW(quantityAt(field, view, buffers, ColorBy::difference, {}), Error);
}

TEST(Quantity, ofASurfaceIsThatOfItsHits) {
  const Seen seen;
  const SurfaceView view{cameraOf({}, seen.field.domain(), 50, 50), 0};
  const ViewBuffers buffers = makeCpuRenderer(seen.field)->surface(view, 50, 50);
  const auto error = quantityAt(seen.field, view, buffers, ColorBy::error, seen.reference);
  int hits = 0;
  for (std::size_t i = 0; i < error.size(); ++i) {
    if (!buffers.hit(i)) continue;
    ++hits;
    const auto x = static_cast<int>(i % 50), y = static_cast<int>(i / 50);
    const Vector3 ray =
        view.camera.forward + view.camera.right * (2 * (x + 0.5) / 50 - 1) + view.camera.up * (1 - 2 * (y + 0.5) / 50);
    const Vector3 hit = view.camera.eye + ray.normalized() * buffers.distance[i];
    EXPECT_FLOAT_EQ(error[i], float(std::abs(seen.field.value(hit) - (hit.norm() - 0.5))));
  }
  EXPECT_GT(hits, 200);
}

TEST(ScaleOfAQuantity, dependsOnTheCellsOrThePointsOrTheLimits) {
  // One cell fills half of the domain; the other half is divided once.
  FieldData data;
  data.domain = Box(Vector3(0, 0, 0), Vector3(2, 1, 1));
  data.grid = {2, 1, 1};
  data.nodes = {node::leaf(0, 0), node::internal(2)};
  for (int child = 0; child < 8; ++child) data.nodes.push_back(node::leaf(0, 0));
  data.coefficients = std::vector<double>{1};
  const Field field(data);
  std::vector<double> cells(10, 3e-2);
  cells[0] = 2e-4;
  const std::vector<float> samples = {1e-3F, 0.5F, std::numeric_limits<float>::quiet_NaN()};
  EXPECT_DOUBLE_EQ(colorScale({}, field, cells, samples).low(), 1e-4);
  EXPECT_DOUBLE_EQ(colorScale({}, field, cells, samples).high(), 0.1);
  EXPECT_DOUBLE_EQ(colorScale({}, field, {}, samples).high(), 1);
  EXPECT_EQ(colorScale({.limits = {{2, 3}}}, field, cells, samples).low(), 2);
  EXPECT_EQ(colorScale({.logarithmic = false}, field, cells, samples).low(), 0);
}

TEST(ScaleOfAQuantity, isNotStretchedByManyTinyCells) {
  // A third of all leaves are deeper than 4, but fill only 1/4096 of the volume.
  const Field field =
      randomField(4, {.grid = {1, 1, 1}, .refinement = 0, .maxDepth = 6, .deepAt = Vector3(-0.99, -0.99, -0.99)});
  std::vector<double> cells(field.data().nodes.size(), 0.5);
  field.forEachCell([&](const Cell& cell) {
    if (cell.depth > 4) cells[cell.id] = 1000;
  });
  EXPECT_DOUBLE_EQ(colorScale({}, field, cells, {}).high(), 1);
}

}  // namespace quantity_test
}  // namespace hpsdf::render
