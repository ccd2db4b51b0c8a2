// Tests the light that is measured by the field, and feature edges, against what geometry says of a sphere and a box.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "coloring/body_shadow.h"
#include "coloring/field_light.h"
#include "coloring/surface_shader.h"
#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/render/bodies.h"
#include "hpsdf/render/compare.h"
#include "hpsdf/render/picture.h"
#include "hpsdf/render/renderer.h"
#include "hpsdf/shapes.h"
#include "scene/body_view.h"
#include "scene/feature_edges.h"
#include "support/random_field.h"
#include "view/view_buffers.h"

namespace hpsdf::render {
namespace light_test {

constexpr int kWidth = 160, kHeight = 120;

const Field& fieldOf(const char* shape) {
  static std::map<std::string, Field> fields;
  const auto known = fields.find(shape);
  if (known != fields.end()) return known->second;
  const TriangleMesh mesh = shapes::mesh(shape);
  return fields.emplace(shape, build(ExactDistance(mesh), domainAround(mesh), {.targetError = 1e-7})).first->second;
}

/// A view of a field with the light at its samples.
struct Lit {
  SurfaceView view;
  ViewBuffers buffers;
  FieldLight light;
  Vector3 toKey;
};

Lit lit(const Field& field, const SurfaceView& view) {
  Lit result{view, makeCpuRenderer(field)->surface(view, kWidth, kHeight), {}, directionToKey(view.camera, 0)};
  result.light = fieldLight({field, result.view, UpAxis::y, true}, result.buffers, 1, result.toKey);
  return result;
}

Lit litSphere() {
  const Field& field = fieldOf("sphere");
  return lit(field, {cameraOf({}, field.domain(), kWidth, kHeight)});
}

/// Calls visit(point, i) for each sample that shows the ground at height `ground`.
template <typename Visit>
void forEachGroundSample(const Lit& scene, double ground, const Visit& visit) {
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const std::size_t i = std::size_t(y) * kWidth + x;
      const Vector3 ray = pixelRay(scene.view.camera, x, y, kWidth, kHeight);
      if (scene.buffers.hit(i) || ray.y() >= 0 || x > 0.75 * kWidth) continue;  // shadows fade at the right edge
      const Vector3 eye = pixelEye(scene.view.camera, x, y, kWidth, kHeight);
      visit(Vector3(eye + (ground - eye.y()) / ray.y() * ray), i);
    }
}

TEST(FieldLight, leavesTheGroundInTheShadowOfASphere) {
  const Lit scene = litSphere();
  const double radius = -fieldOf("sphere").value(Vector3::Zero());
  int dark = 0, bright = 0;
  forEachGroundSample(scene, -radius, [&](const Vector3& point, std::size_t i) {
    // The distance of the ray towards the lamp from the middle of the sphere, in its radius.
    const double along = -point.dot(scene.toKey);
    const double away = (point + along * scene.toKey).norm() / radius;
    if (point.norm() > 2 * radius) return;  // the shadow fades there
    dark += away < 0.6;
    bright += away > 1.5;
    EXPECT_TRUE(away >= 0.6 || scene.light.lit[i] < 0.1) << point.transpose();
    EXPECT_TRUE(away <= 1.5 || scene.light.lit[i] > 0.9) << point.transpose();
  });
  EXPECT_GT(dark, 100);
  EXPECT_GT(bright, 100);
}

TEST(FieldLight, endsShadowsSoftly) {
  const Lit scene = litSphere();
  const auto between = std::ranges::count_if(scene.light.lit, [](float share) { return share > 0.2 && share < 0.8; });
  EXPECT_GT(between, 200);
}

TEST(FieldLight, leavesASphereOpenAndLitWhereItFacesTheLamp) {
  const Lit scene = litSphere();
  int facing = 0, away = 0;
  for (std::size_t i = 0; i < scene.light.open.size(); ++i) {
    if (!scene.buffers.hit(i)) continue;
    const double towards = scene.buffers.normal[i].cast<double>().dot(scene.toKey);
    facing += towards > 0.3;
    away += towards < -0.4;
    EXPECT_GT(scene.light.open[i], 0.97);
    EXPECT_TRUE(towards <= 0.3 || scene.light.lit[i] > 0.95) << towards << ": " << scene.light.lit[i];
    EXPECT_TRUE(towards >= -0.4 || scene.light.lit[i] == 0) << towards << ": " << scene.light.lit[i];
  }
  EXPECT_GT(facing, 500);
  EXPECT_GT(away, 100);
}

TEST(FieldLight, isMeasuredOnceForAnEvenPixelAndSampleBySampleAtBorders) {
  const Lit scene = litSphere();
  const ShadowCaster caster{fieldOf("sphere"), scene.view, UpAxis::y, true};
  const FieldLight shared = fieldLight(caster, scene.buffers, 2, scene.toKey);
  int even = 0, different = 0;
  for (int y = 0; y < kHeight; y += 2)
    for (int x = 0; x < kWidth; x += 2) {
      const std::size_t first = std::size_t(y) * kWidth + x;
      const std::array<std::size_t, 4> samples = {first, first + 1, first + kWidth, first + kWidth + 1};
      const auto hits = std::ranges::count_if(samples, [&](std::size_t i) { return scene.buffers.hit(i); });
      for (const std::size_t i : samples) {
        if (hits == 0 || hits == 4) {
          even += i != first && shared.lit[i] == shared.lit[first];
          different += std::abs(shared.lit[i] - scene.light.lit[i]) > 0.15;
        } else {
          EXPECT_EQ(shared.lit[i], scene.light.lit[i]) << x << ", " << y;
        }
      }
    }
  EXPECT_GT(even, kWidth * kHeight * 7 / 10);
  EXPECT_LT(different, kWidth * kHeight / 50);
}

TEST(FieldLight, isTheSameAtACrackAsBesideIt) {
  const Field field = randomField(4, {.radius = 0.6, .roughness = 0.03, .maxDepth = 3});
  const Lit scene = lit(field, {cameraOf({}, field.domain(), kWidth, kHeight)});
  constexpr int kReach = 4;
  int cracks = 0, between = 0;
  for (int y = kReach; y < kHeight - kReach; ++y)
    for (int x = kReach; x < kWidth - kReach; ++x) {
      const std::size_t i = std::size_t(y) * kWidth + x;
      if (scene.buffers.crack[i] == 0) continue;
      ++cracks;
      for (int n = 0; n < (2 * kReach + 1) * (2 * kReach + 1); ++n) {
        const std::size_t other =
            std::size_t(y + n / (2 * kReach + 1) - kReach) * kWidth + std::size_t(x + n % (2 * kReach + 1) - kReach);
        const bool isWhole = scene.buffers.crack[other] == 0 && scene.buffers.hit(other);
        if (!isWhole || scene.light.open[other] != scene.light.open[i] || scene.light.lit[other] != scene.light.lit[i])
          continue;
        ++between;
        break;
      }
    }
  EXPECT_GT(cracks, 20);
  EXPECT_GT(between, cracks * 9 / 10);
}

TEST(FieldLight, hasNoGroundBelowTheRestOfAClippedSolid) {
  const Field& field = fieldOf("sphere");
  SurfaceView view{cameraOf({.elevationDegrees = -5}, field.domain(), kWidth, kHeight)};
  const double radius = -field.value(Vector3::Zero());
  ASSERT_LT(view.camera.eye.y(), 0);
  ASSERT_GT(view.camera.eye.y(), -radius);
  const auto darkened = [&] {
    const Lit scene = lit(field, view);
    int count = 0;
    for (std::size_t i = 0; i < scene.light.lit.size(); ++i) count += !scene.buffers.hit(i) && scene.light.lit[i] < 0.9;
    return count;
  };
  EXPECT_GT(darkened(), 50) << "the eye is above the ground of the whole sphere";
  view.clip = ClipPlane{1, 0};
  EXPECT_EQ(darkened(), 0) << "the eye is below the upper half, which would stand on the plane of the cut";
}

TEST(FieldLight, isLessAmbientInTheHoleOfATorusThanOnItsOutside) {
  const Field& field = fieldOf("torus,major=1,minor=0.8");
  OrbitCamera orbit;
  orbit.elevationDegrees = 50;
  orbit.up = UpAxis::z;
  const Lit scene = lit(field, {cameraOf(orbit, field.domain(), kWidth, kHeight)});
  double inside = 0, outside = 0;
  int insideCount = 0, outsideCount = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const std::size_t i = std::size_t(y) * kWidth + x;
      if (!scene.buffers.hit(i)) continue;
      const Vector3 point = pointAt(scene.view, scene.buffers, x, y);
      const double outwards = scene.buffers.normal[i].cast<double>().dot(Vector3(point.x(), point.y(), 0).normalized());
      if (outwards < -0.9 && ++insideCount) inside += scene.light.open[i];
      if (outwards > 0.9 && ++outsideCount) outside += scene.light.open[i];
    }
  ASSERT_GT(insideCount, 50);
  ASSERT_GT(outsideCount, 50);
  EXPECT_LT(inside / insideCount, outside / outsideCount - 0.02);
}

TEST(FieldLight, doesNotCountWhatAClippingPlaneRemoves) {
  const Field& field = fieldOf("sphere");
  SurfaceView view{cameraOf({}, field.domain(), kWidth, kHeight)};
  const double radius = -field.value(Vector3::Zero());
  const Vector3 toKey = directionToKey(view.camera, 0);
  const Lit whole = lit(field, view);
  view.clip = ClipPlane{1, -0.8 * radius};  // a cap is left, which is too flat to throw the shadow of the sphere
  const Lit cap = lit(field, view);
  int freed = 0;
  forEachGroundSample(cap, -radius, [&](const Vector3& point, std::size_t i) {
    const double away = (point - point.dot(toKey) * toKey).norm() / radius;
    const double far = point.norm() / radius;
    if (away >= 0.5 || far < 1.3 || far > 2 || whole.buffers.hit(i)) return;
    ++freed;
    EXPECT_GT(cap.light.lit[i], whole.light.lit[i] + 0.5);
  });
  EXPECT_GT(freed, 20);
}

/// A plate on z = 0 with a ball above it, seen from above by parallel rays.
struct BallAbovePlate {
  std::unique_ptr<BodyRenderer> renderer =
      makeCpuBodyRenderer({shapes::mesh("sphere,radius=0.2"), shapes::mesh("box,width=2,height=2,depth=0.1")});
  std::vector<Body> bodies = {Body{0}, Body{1}};
  SurfaceView view;
  ViewBuffers buffers = emptyBuffers(kWidth, kHeight, true);
  Vector3 toKey = Vector3(1, 0, 1).normalized();

  BallAbovePlate() {
    bodies[0].worldFromBody.translation() = Vector3(0, 0, 0.6);
    view.camera = {Vector3(0, 0, 4), -Vector3::UnitZ(), 1.6 * Vector3::UnitX(), 1.2 * Vector3::UnitY(),
                   Projection::orthographic};
    addBodies(renderer->view(view.camera, bodies, kWidth, kHeight), buffers);
  }

  /// Returns the light at the point of the plate with these coordinates; `extent` is the length of the scene.
  float litAt(double x, double y, double extent) {
    std::vector<float> lit(buffers.cell.size(), 1);
    throwShadows(*renderer, bodies, view, buffers, toKey, extent, lit);
    const PicturePoint at = project(view.camera, Vector3(x, y, 0), kWidth, kHeight);
    const std::size_t i = std::size_t(at.y) * kWidth + std::size_t(at.x);
    EXPECT_EQ(buffers.body[i], 1U) << "the ball hides the point";
    return lit[i];
  }
};

TEST(BodyShadow, fallsAwayFromTheLampWithASoftBorder) {
  BallAbovePlate scene;
  // Rays towards the lamp rise by 45 degrees, so that the ball's middle is above the point at x = -0.55.
  EXPECT_EQ(scene.litAt(-0.55, 0, 2), 0);
  EXPECT_EQ(scene.litAt(0.55, 0, 2), 1);
  EXPECT_EQ(scene.litAt(-0.55, 0.35, 2), 1);
  const float border = scene.litAt(-0.55, 0.2, 8);
  EXPECT_GT(border, 0.1);
  EXPECT_LT(border, 0.9);
}

TEST(BodyShadow, isNotThrownByBodiesMuchLargerThanTheScene) {
  BallAbovePlate scene;
  // The ball's diagonal is 0.69: it is a caster for a scene of length 0.3, and none for a scene of length 0.2.
  EXPECT_EQ(scene.litAt(-0.55, 0, 0.3), 0);
  EXPECT_EQ(scene.litAt(-0.55, 0, 0.2), 1);
}

TEST(ShadowedPicture, isTheSameByBothRenderers) {
  const Field& field = fieldOf("torus");
  SurfacePicture picture;
  picture.width = 320;
  picture.height = 240;
  picture.samples = 2;
  picture.edges = true;
  const auto cpu = makeCpuRenderer(field), gl = makeGlRenderer(field, GlChoice::software);
  const Image expected = draw(*cpu, field, picture), actual = draw(*gl, field, picture);
  const auto differing = [&](const Image& image) {
    std::size_t count = 0;
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        for (int c = 0; c < 3; ++c)
          if (std::abs(image.at(x, y)[c] - expected.at(x, y)[c]) > 4) {
            ++count;
            break;
          }
    return count;
  };
  EXPECT_LT(differing(actual), 20U);
  picture.shadows = false;
  EXPECT_GT(differing(draw(*gl, field, picture)), 2000U) << "shadows make no difference";
}

TEST(ShadowedPicture, hasAGroundOnlyIfTheSolidStandsAlone) {
  const Field& field = fieldOf("sphere");
  const auto renderer = makeCpuRenderer(field);
  SurfacePicture picture;
  picture.width = 320;
  picture.height = 240;
  picture.bare = true;
  picture.shadows = false;
  const Image without = draw(*renderer, field, picture);
  const auto darkened = [&] {
    const Drawn drawn = drawSurface(*renderer, field, picture);
    int count = 0;
    for (int y = 0; y < picture.height; ++y)
      for (int x = 0; x < picture.width; ++x) {
        if (drawn.buffers.hit(std::size_t(y) * picture.width + x)) continue;
        count += drawn.image.at(x, y)[0] + 12 < without.at(x, y)[0];
      }
    return count;
  };
  picture.shadows = true;
  EXPECT_GT(darkened(), 500);
  picture.cells.style = CellStyle::lines;
  picture.cells.depths = {30};  // there are no such cells, but the picture may show some
  EXPECT_EQ(darkened(), 0);
}

TEST(FeatureEdges, areTheEdgesOfABoxAndTheOutlineOfASphere) {
  const Field& box = fieldOf("box");
  const SurfaceView view{cameraOf({}, box.domain(), kWidth, kHeight)};
  const ViewBuffers buffers = makeCpuRenderer(box)->surface(view, kWidth, kHeight);
  const std::vector<float> edges = featureEdges(view, buffers, 1);
  int within = 0, onEdges = 0;
  for (int y = 1; y + 1 < kHeight; ++y)
    for (int x = 1; x + 1 < kWidth; ++x) {
      const std::size_t i = std::size_t(y) * kWidth + x;
      const bool isInside = buffers.hit(i) && buffers.hit(i + 1) && buffers.hit(i + kWidth);
      if (!isInside) continue;
      const bool bends = buffers.normal[i].dot(buffers.normal[i + 1]) < 0.5F ||
                         buffers.normal[i].dot(buffers.normal[i + kWidth]) < 0.5F;
      ++(bends ? onEdges : within);
      EXPECT_EQ(edges[i], bends ? 1 : 0) << x << ", " << y;
    }
  EXPECT_GT(onEdges, 50);
  EXPECT_GT(within, 1000);

  const Lit sphere = litSphere();
  const std::vector<float> outline = featureEdges(sphere.view, sphere.buffers, 1);
  for (std::size_t i = 0; i + kWidth < outline.size(); ++i) {
    const bool hit = sphere.buffers.hit(i);
    const bool isBorder = hit != sphere.buffers.hit(i + 1) || hit != sphere.buffers.hit(i + kWidth);
    EXPECT_TRUE((i + 1) % kWidth == 0 || outline[i] == float(isBorder)) << i;
  }
}

}  // namespace light_test
}  // namespace hpsdf::render
