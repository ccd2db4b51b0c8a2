#include "view/surface_blocks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "hpsdf/render/renderer.h"
#include "support/random_field.h"

namespace hpsdf::render {
namespace surface_blocks_test {

constexpr int kWidth = 203;  // not a multiple of the block size
constexpr int kHeight = 150;

struct Found {
  float side;
  std::vector<float> starts;  ///< ray start of each pixel; infinite if the pixel is in no block
};

Found find(const Field& field, const SurfaceView& view) {
  const GridSpace space(field.data());
  const RayGeometry rays(space, view.camera, kWidth, kHeight);
  const SurfaceBlocks found = surfaceBlocks(field.data(), surfaceBounds(field.data()), space, rays, view.offset);
  Found result{found.side, std::vector<float>(std::size_t(kWidth) * kHeight, std::numeric_limits<float>::infinity())};
  for (const Block& block : found.blocks)
    for (int y = int(block.y); y < std::min(kHeight, int(block.y) + kBlock); ++y)
      for (int x = int(block.x); x < std::min(kWidth, int(block.x) + kBlock); ++x) {
        float& start = result.starts[std::size_t(y) * kWidth + x];
        EXPECT_TRUE(std::isinf(start)) << "blocks overlap";
        start = block.start;
      }
  return result;
}

/// Expects that blocks contain all hits, and that no hit lies before its block's start. Up to this start, or along the
/// whole ray without a block, the bounds of the leaves must exclude the surface.
void expectNothingLeftOut(const Field& field, const SurfaceView& view) {
  const Found found = find(field, view);
  const ViewBuffers truth = makeCpuRenderer(field)->surface(view, kWidth, kHeight);
  const GridSpace space(field.data());
  const RayGeometry rays(space, view.camera, kWidth, kHeight);
  const std::vector<SurfaceBounds> bounds = surfaceBounds(field.data());
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const std::size_t i = std::size_t(y) * kWidth + x;
      if (truth.hit(i)) {
        ASSERT_LE(found.starts[i], truth.distance[i] * (1 + 1e-6F)) << x << ", " << y;
      }
      if (i % 11 != 0) continue;
      const Vector3 start = pixelEye(view.camera, x, y, kWidth, kHeight);
      const Vector3 direction = rays.direction(x, y);
      const double farthest = (start - field.domain().center()).norm() + space.diagonal;
      const double end = std::min<double>(found.starts[i], farthest);
      if (end <= 1e-5) continue;
      for (int step = 1; step <= 200; ++step) {
        const Vector3 point = start + (end - 1e-5) * step / 200 * direction;
        if (!field.domain().contains(point)) continue;
        const SurfaceBounds& leaf = bounds[field.cellAt(point).id];
        ASSERT_TRUE(found.side > 0 ? leaf.lo > view.offset : leaf.hi < view.offset) << x << ", " << y;
      }
    }
}

Camera lookingAt(const Vector3& eye, const Vector3& forward, double halfHeight) {
  const Vector3 unit = forward.normalized();
  const Vector3 right = unit.unitOrthogonal();
  return {eye, unit, right * (halfHeight * kWidth / kHeight), right.cross(unit) * halfHeight};
}

TEST(SurfaceBlocks, includeAllThatIsVisibleFromAnywhere) {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (unsigned seed = 0; seed < 4; ++seed) {
    // The domain is oblong, and the field jumps over the offset at faces of cells.
    const Field field = randomField(seed, {.domain = Box(Vector3(-1, -1.5, -1), Vector3(1, 1, 1.2)),
                                           .grid = {2, 3, 2},
                                           .roughness = seed % 2 ? 1.0 : 0.1,
                                           .maxDepth = 4,
                                           .minDegree = 0});
    for (int i = 0; i < 12; ++i) {
      // Eyes range from far away to inside the domain.
      const Vector3 eye = std::exp2(2 - i % 6) * Vector3(unit(random), unit(random), unit(random));
      const Vector3 forward = i % 2 ? Vector3(unit(random), unit(random), unit(random)) : Vector3(-eye);
      Camera camera = lookingAt(eye, forward, 0.3 + 0.5 * (i % 3));
      expectNothingLeftOut(field, {camera, 0.1 * unit(random)});
      camera.projection = Projection::orthographic;
      expectNothingLeftOut(field, {camera, 0.1 * unit(random)});
    }
  }
}

TEST(SurfaceBlocks, areTheWholeViewForACameraWithoutWidth) {
  const Field field = randomField(1);
  const Camera flat{Vector3(3, 0.1, 0.2), Vector3(-1, 0, 0), Vector3::Zero(), Vector3(0, 0, 0.1)};
  for (const float start : find(field, {flat, 0}).starts) EXPECT_LT(start, 3);
}

/// Makes a sphere's field with small cells.
Field sphere() { return randomField(3, {.roughness = 0.02, .refinement = 1, .maxDepth = 4}); }

/// Expects that blocks contain few pixels beside the surface, and that rays start close to it.
void expectBlocksHugTheSurface(Projection projection) {
  const Field field = sphere();
  const SurfaceView view{cameraOf({.projection = projection}, field.domain(), kWidth, kHeight), 0};
  const Found found = find(field, view);
  const ViewBuffers truth = makeCpuRenderer(field)->surface(view, kWidth, kHeight);
  int drawn = 0, hit = 0;
  double ahead = 0;
  for (std::size_t i = 0; i < found.starts.size(); ++i) {
    drawn += std::isfinite(found.starts[i]);
    if (!truth.hit(i)) continue;
    ++hit;
    ahead += truth.distance[i] - double(found.starts[i]);
  }
  EXPECT_EQ(found.side, 1);
  EXPECT_GT(hit, 2000);
  EXPECT_LT(drawn, 1.8 * hit);
  EXPECT_LT(ahead / hit, 0.1 * field.domain().sizes().norm());
}

TEST(SurfaceBlocks, areFewBesideTheSurface) {
  expectBlocksHugTheSurface(Projection::perspective);
  expectBlocksHugTheSurface(Projection::orthographic);
}

TEST(SurfaceBlocks, areNoneWhereNothingIsVisible) {
  const Field field = sphere();
  const auto count = [&](const SurfaceView& view) {
    const Found found = find(field, view);
    return std::ranges::count_if(found.starts, [](float start) { return std::isfinite(start); });
  };
  const Camera away = lookingAt(Vector3(4, 0, 0), Vector3(1, 0, 0), 0.5);
  EXPECT_EQ(count({away, 0}), 0);
  // This camera looks past the sphere, which lies on both sides of the plane through the eye.
  Camera past = lookingAt(Vector3(0.01, 0.02, 0.9), Vector3(1, 0, 0), 0.1);
  EXPECT_EQ(count({past, 0}), 0);
  past.projection = Projection::orthographic;
  EXPECT_EQ(count({past, 0}), 0);
  Camera behind = lookingAt(Vector3(0.9, 0.01, 0.02), Vector3(1, 0, 0), 0.5);
  behind.projection = Projection::orthographic;
  EXPECT_EQ(count({behind, 0}), 0);
  EXPECT_EQ(count({cameraOf({}, field.domain(), kWidth, kHeight), 5}), 0);
}

}  // namespace surface_blocks_test
}  // namespace hpsdf::render
