// Tests that blended fields are drawn correctly: error bounds, the CPU reference renderer (oracle) and OpenGL.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "compare_buffers.h"
#include "cpu/trace.h"
#include "hpsdf/continuity.h"
#include "hpsdf/render/blend_zone_bounds.h"
#include "hpsdf/render/renderer.h"
#include "hpsdf/render/view.h"
#include "support/random_field.h"
#include "support/require_gl.h"
#include "view/surface_bounds.h"

namespace hpsdf::render {
namespace blended_test {

constexpr int kWidth = 64, kHeight = 48;

Field jumping(unsigned seed, double roughness = 0.3) {
  return randomField(seed, {.domain = Box(Vector3(-1, -1.5, -1), Vector3(1, 1, 1.2)),
                            .grid = {2, 3, 2},
                            .roughness = roughness,
                            .maxDepth = 3,
                            .maxDegree = 5});
}

std::vector<SurfaceView> views(const Field& field) {
  std::vector<SurfaceView> result;
  for (const double azimuth : {20.0, 140.0})
    for (const Projection projection : {Projection::perspective, Projection::orthographic})
      result.push_back({cameraOf({.azimuthDegrees = azimuth, .elevationDegrees = azimuth / 6, .projection = projection},
                                 field.domain(), kWidth, kHeight),
                        0.02});
  return result;
}

std::vector<SliceView> slices(const Field& field) {
  return {axisSlice(field.domain(), 2, 0.13, kWidth, kHeight), axisSlice(field.domain(), 0, 0.0, kWidth, kHeight),
          planeSlice(field.domain(), field.domain().center(), Vector3(1, -2, 0.5), kWidth, kHeight)};
}

/// Returns the difference between a blended field and its unblended version at local coordinates of a leaf.
double differenceAt(const Field& smooth, const Field& plain, const Cell& cell, const Vector3& local) {
  const Vector3 x = cell.box.center() + (cell.box.sizes() / 2).cwiseProduct(local);
  return smooth.value(x) - plain.value(x);
}

TEST(BlendZoneBounds, holdWithinTheWholeLeaf) {
  for (const unsigned seed : {1u, 2u, 3u})
    for (const double width : {0.05, 0.25}) {
      const Field plain = jumping(seed, 1), smooth = blended(plain, width);
      const TraceField polynomials(plain);
      const std::vector<BlendZoneBounds> zones = blendZoneBounds(smooth);
      ASSERT_EQ(zones.size(), smooth.data().nodes.size());
      const std::vector<SurfaceBounds> bounds = surfaceBounds(smooth.data(), zones);
      std::mt19937 random(seed);
      std::uniform_real_distribution<double> unit(-1, 1);
      double closest = 0, closestTwist = 0, mostSag = 0;
      smooth.forEachCell([&](const Cell& cell) {
        const BlendZoneBounds& zone = zones[cell.id];
        for (int n = 0; n < 100; ++n) {
          Vector3 local(unit(random), unit(random), unit(random));
          const int axis = n % 3;
          if (n % 2 == 1) local[axis] = std::copysign(1 - 2 * width * std::abs(unit(random)), local[axis]);
          const double apart = std::abs(differenceAt(smooth, plain, cell, local));
          ASSERT_LE(apart, zone.valueDifference);
          const double value = smooth.value(cell.box.center() + (cell.box.sizes() / 2).cwiseProduct(local));
          ASSERT_LE(value, bounds[cell.id].hi);
          ASSERT_GE(value, bounds[cell.id].lo);
          closest = std::max(closest, apart / zone.valueDifference);
          if ((local.cwiseAbs().array() < 1 - 2 * width).all()) {
            ASSERT_EQ(apart, 0);
            continue;
          }
          // The segment from -half to half is a quarter as long as a blending weight reaches.
          const Vector3 half = zone.extent / 8 * Vector3(unit(random), unit(random), unit(random)).normalized();
          if ((local.cwiseAbs() + half.cwiseAbs()).maxCoeff() > 1) continue;
          const double sag = 0.5 * (differenceAt(smooth, plain, cell, local - half) +
                                    differenceAt(smooth, plain, cell, local + half)) -
                             differenceAt(smooth, plain, cell, local);
          mostSag = std::max(mostSag, std::abs(sag) / zone.valueDifference);
        }
        // Compares this leaf's gradient with its neighbour's where the neighbour's blending weight reaches into it.
        for (int n = 0; n < 30; ++n) {
          Vector3 local(unit(random), unit(random), unit(random)), across = local;
          const int axis = n % 3;
          local[axis] = std::copysign(1 - 2 * width * 0.01, local[axis]);
          across[axis] = std::copysign(1.001, local[axis]);
          const Vector3 scale = polynomials.space().grid.cwiseQuotient(polynomials.space().size);
          const auto inGrid = [&](const Vector3& at) -> Vector3 {
            return (cell.box.center() + (cell.box.sizes() / 2).cwiseProduct(at) - plain.domain().min())
                .cwiseProduct(scale);
          };
          if ((inGrid(across).array() < 0).any() || (inGrid(across) - polynomials.space().grid).maxCoeff() > 0)
            continue;
          const CellPoint own = polynomials.leafAt(inGrid(local)), other = polynomials.leafAt(inGrid(across));
          ASSERT_EQ(own.node, cell.id);
          ASSERT_NE(other.node, cell.id);
          const Vector3 localThere =
              2 * ((inGrid(local) - other.base) * std::ldexp(1.0, other.depth) - other.path) - Vector3::Ones();
          const Vector3 twist =
              std::ldexp(1.0, other.depth - own.depth) * polynomials.sample(other, localThere).gradient -
              polynomials.sample(own, local).gradient;
          ASSERT_LE(twist.norm(), zone.gradientDifference);
          closestTwist = std::max(closestTwist, twist.norm() / zone.gradientDifference);
        }
      });
      EXPECT_GT(closest, 0.2) << "bounds so wide tell nothing";
      EXPECT_GT(closestTwist, 0.1) << "bounds so wide tell nothing";
      EXPECT_LT(mostSag, 0.05);
      EXPECT_GT(mostSag, 0.002);
    }
  EXPECT_TRUE(blendZoneBounds(jumping(1)).empty());
}

TEST(BlendedSlice, ofTheOracleHasTheFieldsValues) {
  for (const unsigned seed : {4u, 5u}) {
    const Field field = jumping(seed), smooth = blended(field, 0.1);
    std::size_t changed = 0;
    for (SliceView view : slices(field)) {
      view.origin += 0.00137 * view.right + 0.00211 * view.up;  // avoids samples on faces of cells
      const ViewBuffers buffers = makeCpuRenderer(smooth)->slice(view, kWidth, kHeight);
      for (std::size_t i = 0; i < buffers.cell.size(); ++i) {
        if (!buffers.hit(i)) continue;
        const double x = double(i % kWidth), y = double(i / kWidth);
        const Vector3 point =
            view.origin + view.right * ((x + 0.5) / kWidth - 0.5) + view.up * (0.5 - (y + 0.5) / kHeight);
        ASSERT_NEAR(buffers.value[i], smooth.value(point), 1e-6);
        changed += std::abs(field.value(point) - smooth.value(point)) > 1e-3;
      }
    }
    EXPECT_GT(changed, 300u);
  }
}

TEST(BlendedTrace, ofTheOracleFindsTheFirstCrossing) {
  for (const unsigned seed : {6u, 7u}) {
    const Field smooth = blended(jumping(seed, 0.1), 0.1);
    const auto renderer = makeCpuRenderer(smooth);
    std::size_t seen = 0;
    for (const SurfaceView& view : views(smooth)) {
      const ViewBuffers buffers = renderer->surface(view, kWidth, kHeight);
      for (std::size_t i = 0; i < buffers.cell.size(); i += 11) {
        if (!buffers.hit(i)) continue;
        ++seen;
        const int x = int(i % kWidth), y = int(i / kWidth);
        const Vector3 start = rayStart(view.camera, kWidth, kHeight, x, y);
        const Vector3 ray = rayDirection(view.camera, kWidth, kHeight, x, y);
        const ValueAndGradient hit = smooth.valueAndGradient(start + double(buffers.distance[i]) * ray);
        if (buffers.value[i] - view.offset < 1e-4) {  // false if the ray starts inside the solid
          ASSERT_NEAR(hit.value, view.offset, 2e-4);
          ASSERT_GT(hit.gradient.normalized().dot(buffers.normal[i].cast<double>()), 0.999);
        }
        double side = 0;
        for (double t = 0; t < buffers.distance[i] - 1e-4; t += 5e-3) {
          const Vector3 point = start + t * ray;
          if (!smooth.domain().contains(point)) continue;
          const double height = smooth.value(point) - view.offset;
          if (side == 0) side = height;
          ASSERT_GE(height * side, 0) << "at " << t << " of " << buffers.distance[i];
        }
      }
    }
    EXPECT_GT(seen, 200u);
  }
}

TEST(BlendedOpenGl, drawsWhatTheOracleDraws) {
  HPSDF_REQUIRE_GL();
  for (const unsigned seed : {8u})
    for (const double width : {kDefaultBlend, 0.25}) {
      const Field smooth = blended(jumping(seed, 0.15), width);
      const auto cpu = makeCpuRenderer(smooth), gl = makeGlRenderer(smooth, support::testedGl());
      for (const SliceView& view : slices(smooth))
        EXPECT_TRUE(agree(cpu->slice(view, kWidth, kHeight), gl->slice(view, kWidth, kHeight), {.value = 4e-6}));
      const double diagonal = smooth.domain().sizes().norm();
      for (const SurfaceView& view : views(smooth))
        EXPECT_TRUE(agree(cpu->surface(view, kWidth, kHeight), gl->surface(view, kWidth, kHeight),
                          {.value = 1e-4, .position = 1e-5 * diagonal, .normalAngle = 1e-2}, &view.camera));
    }
}

/// The comparison must reject a field with another blend width and a field without blending.
TEST(BlendedOpenGl, differsForAWrongField) {
  HPSDF_REQUIRE_GL();
  const Field field = jumping(10);
  const SliceView view = slices(field).front();
  const ViewBuffers expected = makeCpuRenderer(blended(field, 0.1))->slice(view, kWidth, kHeight);
  for (const double width : {0.0, 0.0999})
    EXPECT_FALSE(agree(expected,
                       makeGlRenderer(blended(field, width), support::testedGl())->slice(view, kWidth, kHeight),
                       {.value = 4e-6}))
        << width;
}

/// Where cells of very different depths meet, single precision is less accurate for weights of the smallest cells.
TEST(BlendedOpenGl, drawsDeepOctrees) {
  HPSDF_REQUIRE_GL();
  const Field smooth = blended(
      randomField(4, {.grid = {3, 3, 3}, .refinement = 0.1, .maxDepth = 12, .deepAt = Vector3(0.1, 0.2, 0.3)}), 0.2);
  Box deepest;
  int depth = 0;
  smooth.forEachCell([&](const Cell& cell) {
    if (cell.depth > depth) deepest = cell.box;
    depth = std::max(depth, cell.depth);
  });
  ASSERT_EQ(depth, 12);
  const SliceView close{deepest.center(), 40 * deepest.sizes().x() * Vector3::UnitX(),
                        30 * deepest.sizes().y() * Vector3::UnitY()};
  EXPECT_TRUE(agree(makeCpuRenderer(smooth)->slice(close, kWidth, kHeight),
                    makeGlRenderer(smooth, support::testedGl())->slice(close, kWidth, kHeight), {.value = 5e-5}));
}

TEST(BlendedField, hasNoCracks) {
  const auto count = [](const Field& field, bool gl) {
    std::size_t cracks = 0;
    const auto renderer = gl ? makeGlRenderer(field, support::testedGl()) : makeCpuRenderer(field);
    for (const SurfaceView& view : views(field))
      for (const std::uint8_t crack : renderer->surface(view, kWidth, kHeight).crack) cracks += crack;
    return cracks;
  };
  const Field field = jumping(11);
  for (const bool gl : {false, true}) {
    if (gl && !support::glProblem().empty()) continue;
    EXPECT_GT(count(field, gl), 100u);
    EXPECT_EQ(count(blended(field), gl), 0u) << (gl ? "OpenGL" : "CPU");
  }
}

}  // namespace blended_test
}  // namespace hpsdf::render
