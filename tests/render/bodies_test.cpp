// Tests bodies in pictures: the CPU renderer (oracle) against formulas, OpenGL against the oracle, and the pictures.

#include "hpsdf/render/bodies.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "coloring/color_view.h"
#include "hpsdf/build.h"
#include "hpsdf/error.h"
#include "hpsdf/render/picture.h"
#include "hpsdf/shapes.h"
#include "scene/body_meshes.h"
#include "scene/body_view.h"
#include "support/require_gl.h"
#include "view/supersampling.h"

namespace hpsdf::render {
namespace bodies_test {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr int kWidth = 160;
constexpr int kHeight = 120;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
const Box kDomain(Vector3(-2, -2, -2), Vector3(2, 2, 2));
constexpr Projection kProjections[] = {Projection::perspective, Projection::orthographic};

Camera cameraFrom(Projection projection, double azimuth = 35, double elevation = 25, double distance = 1.1,
                  int width = kWidth, int height = kHeight) {
  return cameraOf(
      {.azimuthDegrees = azimuth, .elevationDegrees = elevation, .distance = distance, .projection = projection},
      kDomain, width, height);
}

Eigen::Isometry3d placed(const Vector3& place, double angle = 0, const Vector3& axis = Vector3::UnitZ()) {
  return Eigen::Translation3d(place) * Eigen::AngleAxisd(angle, axis.normalized());
}

/// Returns a wavy sheet of n × n squares over [-1, 1]². It is open and seen from both sides.
TriangleMesh sheet(int n, double phase) {
  TriangleMesh mesh{.vertices = {}, .triangles = {}, .name = "sheet"};
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const double x = 2.0 * i / n - 1, y = 2.0 * j / n - 1;
      mesh.vertices.emplace_back(x, y, 0.3 * std::sin(4 * x + phase) * std::cos(3 * y));
    }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * (n + 1) + i); };
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

TriangleMesh smallBox() {
  TriangleMesh mesh = shapes::mesh("box");
  const double scale = 0.5 / boundingBox(mesh).sizes().maxCoeff();
  for (Vector3& vertex : mesh.vertices) vertex *= scale;
  return mesh;
}

std::vector<TriangleMesh> testMeshes() {
  return {shapes::mesh("sphere,radius=0.3,subdivisions=3"), shapes::mesh("gear,teeth=12"), shapes::mesh("box"),
          sheet(24, 0)};
}

/// Returns bodies with random positions and rotations in the domain; some intersect each other.
std::vector<Body> crowd(unsigned seed, int count, std::uint32_t meshes) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> within(-1.6, 1.6);
  std::vector<Body> bodies;
  for (int i = 0; i < count; ++i) {
    const Vector3 place(within(random), within(random), within(random));
    const Vector3 axis(within(random), within(random), within(random));
    bodies.push_back({std::uint32_t(i) % meshes, placed(place, within(random) * 2, axis), bodyColor(std::size_t(i))});
  }
  return bodies;
}

// --- Comparison of OpenGL's buffers with the oracle's buffers
// -------------------------------------------------

struct BodyTolerance {
  double position = 0;        ///< same triangle: difference of distances along the ray, in world units
  double besidePixels = 0.1;  ///< different triangles: difference across the oracle's triangle, in pixels
  double normal = 1e-5;       ///< same triangle: norm of the normals' difference
  double pixels = 1e-3;       ///< fraction of pixels, at edges only, that may show different bodies
};

bool atEdge(const BodyBuffers& buffers, int x, int y) {
  const std::uint32_t here = buffers.body[std::size_t(y) * buffers.width + x];
  for (int v = std::max(0, y - 1); v <= std::min(buffers.height - 1, y + 1); ++v)
    for (int u = std::max(0, x - 1); u <= std::min(buffers.width - 1, x + 1); ++u)
      if (buffers.body[std::size_t(v) * buffers.width + u] != here) return true;
  return false;
}

/// Both buffers must show the same bodies, except for few pixels next to an edge of a body. Where the triangles agree,
/// distances and normals must agree too; where they differ, the distances across the surface must agree, or the pixel
/// counts as one of the few.
testing::AssertionResult agree(const BodyBuffers& expected, const BodyBuffers& actual, const Camera& camera,
                               const BodyTolerance& tolerance) {
  if (expected.width != actual.width || expected.height != actual.height)
    return testing::AssertionFailure() << "sizes differ";
  std::size_t differing = 0, otherTriangles = 0, hits = 0;
  for (int y = 0; y < expected.height; ++y)
    for (int x = 0; x < expected.width; ++x) {
      const std::size_t i = std::size_t(y) * expected.width + x;
      const auto failure = [&] { return testing::AssertionFailure() << "pixel (" << x << ", " << y << "): "; };
      if (expected.body[i] != actual.body[i]) {
        ++differing;
        if (!atEdge(expected, x, y) && !atEdge(actual, x, y))
          return failure() << "body " << actual.body[i] << " instead of " << expected.body[i] << ", far from any edge";
        continue;
      }
      if (!expected.hit(i)) {
        if (actual.distance[i] != 0 || !actual.normal[i].isZero(0)) return failure() << "something where nothing is";
        continue;
      }
      ++hits;
      const Vector3 ray = pixelRay(camera, x, y, expected.width, expected.height);
      const double apart = std::abs(double(expected.distance[i]) - actual.distance[i]);
      if (expected.triangle[i] != actual.triangle[i]) {
        ++otherTriangles;
        const double depth = expected.distance[i] * ray.dot(camera.forward);
        const double cosine = std::abs(ray.dot(expected.normal[i].cast<double>()));
        if (apart * cosine > tolerance.besidePixels * pixelSize(camera, depth, expected.height)) ++differing;
        continue;
      }
      if (!(apart <= tolerance.position))
        return failure() << "distance " << actual.distance[i] << " instead of " << expected.distance[i];
      if (!((expected.normal[i] - actual.normal[i]).norm() <= tolerance.normal))
        return failure() << "normal differs by " << (expected.normal[i] - actual.normal[i]).norm();
    }
  if (double(differing) > tolerance.pixels * double(expected.body.size()))
    return testing::AssertionFailure() << differing << " of " << expected.body.size() << " pixels differ";
  if (double(otherTriangles) > 0.04 * double(hits))
    return testing::AssertionFailure() << otherTriangles << " of " << hits << " pixels show another triangle";
  return testing::AssertionSuccess() << differing << " differ, " << otherTriangles << " of " << hits << " beside";
}

constexpr BodyTolerance kTolerance{.position = 2e-6};

// --- Normals
// ----------------------------------------------------------------------------------------------------------

TEST(BodyNormals, areSmoothOnASphereAndFlatOnABox) {
  const BodyMesh sphere(shapes::mesh("sphere"));
  const Vector3 third = Vector3::Constant(1.0 / 3);
  for (std::uint32_t t = 0; t < sphere.triangles().size(); t += 7)
    for (int k = 0; k < 3; ++k) {
      const Vector3 outward = sphere.vertices()[sphere.triangles()[t][k]].normalized();
      EXPECT_LT((sphere.normal(t, Vector3::Unit(k)) - outward).norm(), 2e-3);
    }
  const BodyMesh box(shapes::mesh("box"));
  for (std::uint32_t t = 0; t < box.triangles().size(); ++t) {
    const Vector3 at = box.normal(t, third);
    EXPECT_NEAR(at.cwiseAbs().maxCoeff(), 1, 1e-6);
    EXPECT_GT(at.dot(box.vertices()[box.triangles()[t][0]]), 0) << "inward";
    for (int k = 0; k < 3; ++k) EXPECT_LT((box.normal(t, Vector3::Unit(k)) - at).norm(), 1e-6);
  }
}

TEST(BodyNormals, weighAFanOfSmallTrianglesByItsAngle) {
  // The roof has two slopes of 10 degrees; one slope is divided into many triangles that meet in a vertex of the ridge.
  const double slope = 10 * std::numbers::pi / 180;
  TriangleMesh mesh{.vertices = {Vector3::Zero()}, .triangles = {}, .name = "roof"};
  const auto add = [&](double from, double to, double tilt) {
    for (const double angle : {from, to})
      mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), tilt * std::tan(slope) * std::abs(std::sin(angle)));
    const auto last = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
    mesh.triangles.push_back({0, last - 1, last});
  };
  constexpr int kFan = 12;
  for (int i = 0; i < kFan; ++i) add(std::numbers::pi * i / kFan, std::numbers::pi * (i + 1) / kFan, -1);
  for (int i = 0; i < 3; ++i) add(std::numbers::pi * (1 + i / 3.0), std::numbers::pi * (1 + (i + 1) / 3.0), -1);
  const BodyMesh roof(std::move(mesh));
  EXPECT_LT((roof.normal(0, Vector3::UnitX()) - Vector3::UnitZ()).norm(), 1e-3);
}

TEST(BodyNormals, ignoreDegenerateTriangles) {
  TriangleMesh mesh = shapes::mesh("box");
  mesh.triangles.push_back({0, 0, 1});
  mesh.triangles.push_back({2, 2, 2});
  const BodyMesh box(std::move(mesh));
  for (std::uint32_t t = 0; t < 12; ++t) EXPECT_NEAR(box.normal(t, Vector3::UnitX()).cwiseAbs().maxCoeff(), 1, 1e-6);
}

// --- The oracle
// ---------------------------------------------------------------------------------------------------------

/// The entry of a ray into a box around the origin. `margin` is the length of the ray within the box, which is small if
/// the ray nearly misses the box.
struct Entry {
  double distance;
  int axis;
  double margin;
};
std::optional<Entry> enter(const Vector3& half, const Vector3& start, const Vector3& direction, double& margin) {
  std::array<double, 3> in, out;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (-half[axis] - start[axis]) / direction[axis], b = (half[axis] - start[axis]) / direction[axis];
    in[axis] = std::min(a, b);
    out[axis] = std::max(a, b);
  }
  const auto last = std::ranges::max_element(in);
  const double distance = *last, leaves = std::ranges::min(out);
  margin = std::min(margin, std::abs(leaves - distance));
  if (!(distance < leaves) || distance <= 0) return std::nullopt;
  return Entry{distance, static_cast<int>(last - in.begin()), leaves - distance};
}

TEST(CpuBodies, showBoxesWhereTheirSlabsAre) {
  const TriangleMesh mesh = shapes::mesh("box");
  const Vector3 half = 0.5 * boundingBox(mesh).sizes();
  const auto cpu = makeCpuBodyRenderer({mesh});
  std::vector<Body> bodies = crowd(3, 12, 1);
  for (const Projection projection : kProjections) {
    const Camera camera = startingBefore(cpu->bounds(bodies), cameraFrom(projection, 35, 25, 2.5));
    const BodyBuffers buffers = cpu->view(camera, bodies, kWidth, kHeight);
    int hits = 0, unsure = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const std::size_t i = std::size_t(y) * kWidth + x;
        const Vector3 eye = pixelEye(camera, x, y, kWidth, kHeight), ray = pixelRay(camera, x, y, kWidth, kHeight);
        double nearest = kInfinity, margin = kInfinity;
        std::uint32_t body = kNoBody;
        Vector3 normal = Vector3::Zero();
        for (std::size_t b = 0; b < bodies.size(); ++b) {
          const Eigen::Isometry3d inverse = bodies[b].worldFromBody.inverse();
          const Vector3 direction = inverse.linear() * ray;
          const auto entry = enter(half, inverse * eye, direction, margin);
          if (!entry) continue;
          margin = std::min(margin, std::abs(entry->distance - nearest));
          if (entry->distance >= nearest) continue;
          nearest = entry->distance;
          body = static_cast<std::uint32_t>(b);
          normal = bodies[b].worldFromBody.linear() *
                   (Vector3::Unit(entry->axis) * (direction[entry->axis] > 0 ? -1.0 : 1.0));
        }
        if (margin < 1e-6) {
          ++unsure;
          continue;
        }
        ASSERT_EQ(buffers.body[i], body) << x << "," << y;
        if (body == kNoBody) continue;
        ++hits;
        ASSERT_NEAR(buffers.distance[i], nearest, 1e-6 * nearest);
        ASSERT_LT((buffers.normal[i].cast<double>() - normal).norm(), 1e-5);
      }
    EXPECT_GT(hits, 2000);
    EXPECT_LT(unsure, 20);
  }
}

/// Returns the distance at which a ray meets a triangle, found from the volumes that the ray spans with its edges.
std::optional<double> meetByVolumes(const Vector3& start, const Vector3& ray, const std::array<Vector3, 3>& corners) {
  std::array<double, 3> volumes;
  for (int k = 0; k < 3; ++k) volumes[k] = ray.dot((corners[(k + 1) % 3] - start).cross(corners[(k + 2) % 3] - start));
  const auto [low, high] = std::ranges::minmax(volumes);
  if (low < 0 && high > 0) return std::nullopt;
  const double sum = volumes[0] + volumes[1] + volumes[2];
  if (sum == 0) return std::nullopt;
  Vector3 point = Vector3::Zero();
  for (int k = 0; k < 3; ++k) point += volumes[k] / sum * corners[k];
  return (point - start).dot(ray);
}

TEST(CpuBodies, showTheNearestTriangleEvenFromAmongTheBodies) {
  const std::vector<TriangleMesh> meshes = testMeshes();
  const auto cpu = makeCpuBodyRenderer(meshes);
  const std::vector<Body> bodies = crowd(5, 16, 4);
  for (const Projection projection : kProjections)
    for (const bool within : {false, true}) {
      Camera camera = cameraFrom(projection);
      if (within) camera.eye = Vector3(0.1, 0.2, -0.1);
      const BodyBuffers buffers = cpu->view(camera, bodies, kWidth, kHeight);
      int hits = 0;
      for (std::size_t i = 0; i < buffers.body.size(); i += 41) {
        const int x = int(i) % kWidth, y = int(i) / kWidth;
        const Vector3 eye = pixelEye(camera, x, y, kWidth, kHeight), ray = pixelRay(camera, x, y, kWidth, kHeight);
        double nearest = kInfinity;
        std::uint32_t body = kNoBody;
        for (std::size_t b = 0; b < bodies.size(); ++b)
          for (const auto& triangle : meshes[bodies[b].mesh].triangles) {
            std::array<Vector3, 3> corners;
            for (int k = 0; k < 3; ++k)
              corners[k] = bodies[b].worldFromBody * meshes[bodies[b].mesh].vertices[triangle[k]];
            const auto distance = meetByVolumes(eye, ray, corners);
            if (!distance || *distance <= 1e-3 || *distance >= nearest) continue;
            nearest = *distance;
            body = static_cast<std::uint32_t>(b);
          }
        ASSERT_EQ(buffers.body[i], body) << x << "," << y;
        if (body == kNoBody) continue;
        ++hits;
        EXPECT_NEAR(buffers.distance[i], nearest, 1e-6 * nearest);
        EXPECT_NEAR(buffers.normal[i].norm(), 1, 1e-5);
      }
      EXPECT_GT(hits, 60);
    }
}

TEST(CpuBodies, haveNormalsThatFaceTheEyeOnBothSidesOfASheet) {
  const auto cpu = makeCpuBodyRenderer({sheet(40, 1)});
  const std::vector<Body> bodies = {Body{}};
  for (const double elevation : {80.0, -80.0}) {
    const Camera camera = cameraOf({.elevationDegrees = elevation, .up = UpAxis::z}, kDomain, kWidth, kHeight);
    const BodyBuffers buffers = cpu->view(camera, bodies, kWidth, kHeight);
    int hits = 0;
    for (std::size_t i = 0; i < buffers.body.size(); ++i) {
      if (!buffers.hit(i)) continue;
      ++hits;
      EXPECT_GT(buffers.normal[i].z() * (elevation > 0 ? 1 : -1), 0);
    }
    EXPECT_GT(hits, 1000);
  }
}

TEST(CpuBodies, areTheSameForAnyNumberOfThreads) {
  const auto cpu = makeCpuBodyRenderer(testMeshes());
  const std::vector<Body> bodies = crowd(9, 12, 4);
  const auto look = [&] { return cpu->view(cameraFrom(Projection::perspective), bodies, kWidth, kHeight); };
  const BodyBuffers many = look();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const BodyBuffers single = look();
  EXPECT_EQ(many.body, single.body);
  EXPECT_EQ(many.triangle, single.triangle);
  EXPECT_EQ(many.distance, single.distance);
  EXPECT_EQ(many.normal, single.normal);
}

// --- OpenGL against the oracle
// --------------------------------------------------------------------------------------------

class GlBodies : public testing::Test {
 protected:
  void SetUp() override { HPSDF_REQUIRE_GL(); }

  static std::unique_ptr<BodyRenderer> gl(std::vector<TriangleMesh> meshes) {
    return makeGlBodyRenderer(std::move(meshes), support::testedGl());
  }
};

TEST_F(GlBodies, areThoseOfTheOracle) {
  const auto cpu = makeCpuBodyRenderer(testMeshes());
  const auto device = gl(testMeshes());
  EXPECT_EQ(device->description(), glDescription(support::testedGl()));
  for (unsigned seed = 0; seed < 4; ++seed) {
    const std::vector<Body> bodies = crowd(seed, 20 + 30 * int(seed), 4);
    for (const Projection projection : kProjections)
      for (const double distance : {0.3, 1.1, 8.0}) {
        Camera camera = cameraFrom(projection, 80.0 * seed, 50.0 - 30 * seed, distance);
        if (distance < 1 && projection == Projection::orthographic) camera.eye += 2.0 * camera.forward;  // in the crowd
        const BodyBuffers expected = cpu->view(camera, bodies, kWidth, kHeight);
        const auto result = agree(expected, device->view(camera, bodies, kWidth, kHeight), camera, kTolerance);
        EXPECT_TRUE(result) << result.message() << " (seed " << seed << ", distance " << distance << ")";
        EXPECT_GT(std::ranges::count_if(expected.body, [](std::uint32_t b) { return b != kNoBody; }), 50);
      }
  }
}

TEST_F(GlBodies, differForAWrongScene) {
  const auto cpu = makeCpuBodyRenderer(testMeshes());
  const auto device = gl(testMeshes());
  const std::vector<Body> bodies = crowd(1, 40, 4);
  const Camera camera = cameraFrom(Projection::perspective);
  const BodyBuffers expected = cpu->view(camera, bodies, kWidth, kHeight);
  ASSERT_TRUE(agree(expected, device->view(camera, bodies, kWidth, kHeight), camera, kTolerance));
  const auto wrong = [&](const std::vector<Body>& others) {
    return !agree(expected, device->view(camera, others, kWidth, kHeight), camera, kTolerance);
  };
  const std::uint32_t seen = expected.body[std::size_t(kHeight / 2) * kWidth + kWidth / 2];
  ASSERT_NE(seen, kNoBody);
  std::vector<Body> moved = bodies;
  moved[seen].worldFromBody.pretranslate(1e-5 * camera.forward);
  EXPECT_TRUE(wrong(moved)) << "moved by five times the bound of distances";
  std::vector<Body> turned = bodies;
  turned[seen].worldFromBody.rotate(Eigen::AngleAxisd(1e-4, Vector3(1, 2, 3).normalized()));
  EXPECT_TRUE(wrong(turned));
  std::vector<Body> swapped = bodies;
  std::swap(swapped[seen], swapped[(seen + 4) % swapped.size()]);
  EXPECT_TRUE(wrong(swapped));
  std::vector<Body> missing = bodies;
  missing[seen].worldFromBody.translation() = Vector3(0, 100, 0);
  EXPECT_TRUE(wrong(missing));
  Camera aside = camera;
  aside.eye += 0.3 * pixelSize(camera, (Vector3::Zero() - camera.eye).norm(), kHeight) * camera.right.normalized();
  EXPECT_FALSE(agree(expected, device->view(aside, bodies, kWidth, kHeight), camera, kTolerance));
}

TEST_F(GlBodies, haveNoSeamsInViewsOfSeveralTiles) {
  const auto cpu = makeCpuBodyRenderer(testMeshes());
  const auto device = gl(testMeshes());
  const std::vector<Body> bodies = crowd(2, 40, 4);
  for (const Projection projection : kProjections)
    for (const auto& [width, height] : {std::pair(4200, 60), std::pair(60, 2100)}) {
      Camera camera = cameraFrom(projection, 20, 20, 0.7, width, height);
      const double narrow = std::min(1.0, double(height) / width);
      camera.right *= narrow;
      camera.up *= narrow;
      camera = startingBefore(cpu->bounds(bodies), camera);
      const auto result = agree(cpu->view(camera, bodies, width, height), device->view(camera, bodies, width, height),
                                camera, kTolerance);
      EXPECT_TRUE(result) << result.message();
    }
}

TEST_F(GlBodies, showMovedVerticesAsAMeshMadeOfThem) {
  const Camera camera = cameraFrom(Projection::perspective, 20, 40, 0.9);
  std::vector<Body> bodies = crowd(4, 8, 2);
  bodies[1].worldFromBody = placed(Vector3(0, 0, 0.2), 1, Vector3::UnitX());
  const std::vector<TriangleMesh> before = {shapes::mesh("box"), sheet(60, 0)};
  TriangleMesh later = sheet(60, 1.5);
  for (Vector3& vertex : later.vertices) vertex += Vector3(30, 0, 0);  // moves its center too
  for (Body& body : bodies)
    if (body.mesh == 1) body.worldFromBody.translate(Vector3(-30, 0, 0));
  const auto device = gl(before);
  const auto cpu = makeCpuBodyRenderer(before);
  const BodyBuffers old = device->view(camera, bodies, kWidth, kHeight);
  for (BodyRenderer* renderer : {device.get(), cpu.get()}) renderer->moveVertices(1, later.vertices);
  const BodyBuffers moved = device->view(camera, bodies, kWidth, kHeight);
  const BodyBuffers anew = gl({before[0], later})->view(camera, bodies, kWidth, kHeight);
  EXPECT_EQ(moved.body, anew.body);
  EXPECT_EQ(moved.triangle, anew.triangle);
  EXPECT_EQ(moved.normal, anew.normal);
  EXPECT_EQ(moved.distance, anew.distance);
  EXPECT_NE(moved.body, old.body);
  // Both renderers must agree although the mesh's own coordinates are about 30.
  const auto result = agree(cpu->view(camera, bodies, kWidth, kHeight), moved, camera, kTolerance);
  EXPECT_TRUE(result) << result.message();
}

TEST_F(GlBodies, haveDistancesWithinATriangleSeenAlongItsPlane) {
  const auto device = gl({sheet(1, 0)});
  const std::vector<Body> bodies = {{0, placed(Vector3(0.1, 0.2, 0.3), std::numbers::pi / 2 + 0.4, Vector3::UnitX())}};
  const Vector3 alongPlane = bodies[0].worldFromBody.linear() * Vector3(0.3, 1, 0).normalized();
  int hits = 0;
  for (int i = -20; i <= 20; ++i) {
    Camera camera = cameraFrom(Projection::perspective);
    const Vector3 toMiddle = (bodies[0].worldFromBody.translation() - camera.eye).normalized();
    const Vector3 across = bodies[0].worldFromBody.linear() * Vector3::UnitZ();
    camera.eye = bodies[0].worldFromBody.translation() + 5 * alongPlane + 2e-4 * i * across;
    camera.right = Eigen::Quaterniond::FromTwoVectors(toMiddle, -alongPlane) * camera.right;
    camera.up = Eigen::Quaterniond::FromTwoVectors(toMiddle, -alongPlane) * camera.up;
    camera.forward = -alongPlane;
    double nearest = kInfinity, farthest = 0;
    for (const Vector3& vertex : sheet(1, 0).vertices) {
      const Vector3 fromEye = bodies[0].worldFromBody * vertex - camera.eye;
      nearest = std::min(nearest, fromEye.dot(camera.forward));
      farthest = std::max(farthest, fromEye.norm());
    }
    const BodyBuffers buffers = device->view(camera, bodies, kWidth, kHeight);
    for (std::size_t pixel = 0; pixel < buffers.body.size(); ++pixel) {
      if (!buffers.hit(pixel)) continue;
      ++hits;
      ASSERT_GE(buffers.distance[pixel], nearest * (1 - 1e-6));
      ASSERT_LE(buffers.distance[pixel], farthest * (1 + 1e-6));
    }
  }
  EXPECT_GT(hits, 100);
}

TEST_F(GlBodies, mayBeHundreds) {
  const std::vector<TriangleMesh> meshes = {testMeshes()[0], smallBox()};
  const auto cpu = makeCpuBodyRenderer(meshes);
  const auto device = gl(meshes);
  std::vector<Body> bodies;
  for (int i = 0; i < 800; ++i) {
    const Vector3 place = Vector3(i % 10, i / 10 % 10, i / 100) * 0.7 - Vector3(3, 3, 3);
    bodies.push_back({std::uint32_t(i % 2), placed(place, i, Vector3(1, i % 7, 3)), bodyColor(std::size_t(i))});
  }
  const Camera camera = cameraFrom(Projection::perspective, 30, 20, 2);
  const BodyBuffers actual = device->view(camera, bodies, kWidth, kHeight);
  const auto result = agree(cpu->view(camera, bodies, kWidth, kHeight), actual, camera, kTolerance);
  EXPECT_TRUE(result) << result.message();
  EXPECT_GT(std::set(actual.body.begin(), actual.body.end()).size(), 150u);
}

TEST_F(GlBodies, mayBeNoneOrOutsideTheView) {
  const auto device = gl(testMeshes());
  const Camera camera = cameraFrom(Projection::perspective);
  const std::vector<Body> behind = {{0, placed(camera.eye - 2 * camera.forward)}};
  for (const std::span<const Body> bodies : {std::span<const Body>(), std::span<const Body>(behind)}) {
    const BodyBuffers buffers = device->view(camera, bodies, kWidth, kHeight);
    EXPECT_EQ(std::ranges::count(buffers.body, kNoBody), kWidth * kHeight);
  }
  EXPECT_TRUE(device->bounds({}).isEmpty());
  EXPECT_NO_THROW(gl({})->view(camera, {}, kWidth, kHeight));
}

// --- Errors
// -----------------------------------------------------------------------------------------------------------------

TEST(Bodies, rejectMeshesThatCannotBeDrawn) {
  const auto making = [](const auto& change) {
    TriangleMesh mesh = shapes::mesh("box");
    mesh.name = "crate";
    change(mesh);
    return [mesh] { makeCpuBodyRenderer({mesh}); };
  };
  EXPECT_THAT(making([](TriangleMesh& m) { m.triangles.clear(); }),
              ThrowsMessage<Error>(HasSubstr("the mesh \"crate\" has no triangles")));
  EXPECT_THAT(making([](TriangleMesh& m) { m.triangles[3][1] = 8; }),
              ThrowsMessage<Error>(HasSubstr("triangle, 3, with a vertex index beyond its 8 vertices")));
  for (const double wrong : {std::nan(""), kInfinity, 1e16})
    EXPECT_THAT(making([&](TriangleMesh& m) { m.vertices[5].y() = wrong; }),
                ThrowsMessage<Error>(HasSubstr("has a vertex, 5, that is not finite")));
  EXPECT_NO_THROW(checkTriangleCount(67108864));
  EXPECT_THAT([] { checkTriangleCount(67108865); }, ThrowsMessage<Error>(HasSubstr("have 67108865 triangles")));
}

TEST(Bodies, rejectInvalidTransforms) {
  const auto cpu = makeCpuBodyRenderer({shapes::mesh("box")});
  const auto drawing = [&](const auto& change) {
    std::vector<Body> bodies = crowd(1, 3, 1);
    change(bodies[2]);
    return [bodies, &cpu] { cpu->view(cameraFrom(Projection::perspective), bodies, kWidth, kHeight); };
  };
  EXPECT_NO_THROW(drawing([](Body&) {})());
  EXPECT_THAT(drawing([](Body& b) { b.mesh = 1; }), ThrowsMessage<Error>(HasSubstr("body 2 has mesh 1 of 1 meshes")));
  EXPECT_THAT(drawing([](Body& b) { b.worldFromBody.translation().x() = std::nan(""); }),
              ThrowsMessage<Error>(HasSubstr("body 2 has a transform that is not finite")));
  EXPECT_THAT(drawing([](Body& b) { b.worldFromBody.linear()(1, 1) = kInfinity; }),
              ThrowsMessage<Error>(HasSubstr("body 2 has a transform that is not finite")));
  EXPECT_THAT(drawing([](Body& b) { b.worldFromBody.linear() *= 1.1; }),
              ThrowsMessage<Error>(HasSubstr("body 2 is scaled or sheared")));
}

TEST(Bodies, rejectViewsAndVerticesThatDoNotFit) {
  const auto cpu = makeCpuBodyRenderer({shapes::mesh("box")});
  const std::vector<Body> bodies = {Body{}};
  Camera camera = cameraFrom(Projection::perspective);
  EXPECT_THAT([&] { cpu->view(camera, bodies, 1 << 20, 1 << 20); }, ThrowsMessage<Error>(HasSubstr("64 million")));
  EXPECT_THAT([&] { cpu->view(camera, bodies, 0, 10); }, ThrowsMessage<Error>(HasSubstr("out of range")));
  camera.right.setZero();
  EXPECT_THAT([&] { cpu->view(camera, bodies, 10, 10); }, ThrowsMessage<Error>(HasSubstr("right or up")));
  camera.eye.x() = kInfinity;
  EXPECT_THAT([&] { cpu->view(camera, bodies, 10, 10); }, ThrowsMessage<Error>(HasSubstr("eye is not finite")));

  std::vector<Vector3> vertices = shapes::mesh("box").vertices;
  EXPECT_THAT([&] { cpu->moveVertices(1, vertices); }, ThrowsMessage<Error>(HasSubstr("mesh 1 of 1 meshes")));
  const Box before = cpu->bounds(bodies);
  for (Vector3& vertex : vertices) vertex *= 2;
  vertices.back().z() = std::nan("");
  EXPECT_THAT([&] { cpu->moveVertices(0, vertices); }, ThrowsMessage<Error>(HasSubstr("vertex, 7")));
  EXPECT_TRUE(cpu->bounds(bodies).isApprox(before)) << "changed by what is refused";
  vertices.pop_back();
  EXPECT_THAT([&] { cpu->moveVertices(0, vertices); }, ThrowsMessage<Error>(HasSubstr("8 vertices, and 7 new ones")));
}

// --- Pictures
// ---------------------------------------------------------------------------------------------------------------

const Field& ball() {
  static const Field field = build(shapes::analytic("sphere"), kDomain, {.targetError = 1e-5});
  return field;
}

/// Returns boxes that are half sunk into the ball's surface, before it, behind it, and outside of the domain.
std::vector<Body> aboutTheBall() {
  std::vector<Body> bodies;
  for (const Vector3& place : {Vector3(0.9, 0.2, 0.6), Vector3(-0.7, 0.8, 0.5), Vector3(0.4, -0.3, 1.7),
                               Vector3(-0.3, 0.2, -1.6), Vector3(0.3, 0.6, 4.0)})
    bodies.push_back({0, placed(place, place.x()), bodyColor(bodies.size())});
  return bodies;
}

TEST(BodyPictures, showTheNearerOfSurfaceAndBody) {
  const auto cpu = makeCpuRenderer(ball());
  const auto bodyRenderer = makeCpuBodyRenderer({smallBox()});
  const std::vector<Body> bodies = aboutTheBall();
  for (const Projection projection : kProjections) {
    SurfacePicture picture{.camera = {.azimuthDegrees = 10, .distance = 0.9, .projection = projection},
                           .color = ColorBy::degree,
                           .width = 240,
                           .height = 180,
                           .samples = 2};
    picture.bodies = {bodyRenderer.get(), bodies, "t = 2.5 s"};
    const Drawn drawn = drawSurface(*cpu, ball(), picture);
    const Camera& camera = std::get<SurfaceView>(drawn.view).camera;
    const int width = drawn.buffers.width, height = drawn.buffers.height;
    const ViewBuffers alone = supersampledSurface(*cpu, {camera}, width / 2, height / 2, 2, true);
    const BodyBuffers seen = bodyRenderer->view(camera, bodies, width, height);
    std::array<int, 3> counts = {};  // pixels of bodies: before the background, before the ball, behind it
    for (std::size_t i = 0; i < alone.cell.size(); ++i) {
      const bool body = seen.hit(i) && (!alone.hit(i) || seen.distance[i] < alone.distance[i]);
      ASSERT_EQ(drawn.buffers.showsBody(i), body);
      ASSERT_EQ(drawn.buffers.hit(i), !body && alone.hit(i));
      ASSERT_EQ(drawn.buffers.distance[i], body ? seen.distance[i] : alone.distance[i]);
      ASSERT_EQ(drawn.buffers.normal[i], body ? seen.normal[i] : alone.normal[i]);
      if (body) {
        ASSERT_EQ(drawn.buffers.body[i], seen.body[i]);
        ASSERT_EQ(drawn.buffers.cell[i], kNoCell);
      }
      if (seen.hit(i)) ++counts[!body ? 2 : alone.hit(i) ? 1 : 0];
    }
    for (const int count : counts) EXPECT_GT(count, 100);
    EXPECT_TRUE(drawn.seen);
    EXPECT_EQ(drawn.details[1], "t = 2.5 s");
    EXPECT_EQ(drawn.details[2], "5 bodies");
    // Bodies in front of the domain are visible with parallel rays too.
    EXPECT_EQ(std::ranges::count(drawn.buffers.body, 4u) > 100, true);

    // Picks find the field only, not bodies.
    int picked = 0, none = 0;
    for (int y = 10; y < drawn.image.height; y += 20)
      for (int x = 10; x < drawn.image.width; x += 20) {
        const int column = 2 * x + 1, row = 2 * y + 1;
        if (column >= width || row >= height) continue;
        const std::size_t i = std::size_t(row) * width + column;
        const auto pick = pickAt(ball(), drawn, x, y);
        EXPECT_EQ(pick.has_value(), drawn.buffers.hit(i));
        (pick ? picked : none) += drawn.buffers.covered(i);
      }
    EXPECT_GT(picked, 3);
    EXPECT_GT(none, 3);
  }
}

double hueOf(Color color) {
  const Oklab lab = toOklab(decodeSrgb(color));
  return std::atan2(lab.b, lab.a) * 180 / std::numbers::pi;
}

double hueDifference(Color a, Color b) { return std::abs(std::remainder(hueOf(a) - hueOf(b), 360)); }

TEST(BodyPictures, keepTheColorsOfBodiesForAnyColorsOfTheField) {
  const auto cpu = makeCpuRenderer(ball());
  const auto bodyRenderer = makeCpuBodyRenderer({smallBox()});
  const std::vector<Body> bodies = aboutTheBall();
  for (const ColorBy color : {ColorBy::normal, ColorBy::depth, ColorBy::slope}) {
    SurfacePicture picture{
        .camera = {.azimuthDegrees = 10, .distance = 0.9}, .color = color, .width = 200, .height = 150, .bare = true};
    picture.bodies = {bodyRenderer.get(), bodies};
    const Drawn drawn = drawSurface(*cpu, ball(), picture);
    picture.bodies = {};
    const Image without = draw(*cpu, ball(), picture);
    int far = 0, count = 0, changed = 0, fieldOnly = 0;
    for (std::size_t i = 0; i < drawn.image.pixels.size(); ++i) {
      if (drawn.buffers.showsBody(i)) {
        ++count;
        far += hueDifference(drawn.image.pixels[i], bodies[drawn.buffers.body[i]].color) > 40;
      } else if (drawn.buffers.hit(i)) {
        ++fieldOnly;
        changed += drawn.image.pixels[i] != without.pixels[i];
      }
    }
    EXPECT_GT(count, 1000);
    EXPECT_LT(far, count / 20);
    // The field's pixels change only where nearby bodies shade the surface.
    EXPECT_LT(changed, fieldOnly / 2);
    EXPECT_GT(changed, 0) << "no shade where bodies touch the surface";
  }
}

TEST(BodyPictures, averageSamplesInLinearLight) {
  const auto cpu = makeCpuRenderer(ball());
  const auto bodyRenderer = makeCpuBodyRenderer({smallBox()});
  const std::vector<Body> bodies = aboutTheBall();
  constexpr int kSamples = 3;
  SurfacePicture picture;
  picture.width = 120;
  picture.height = 90;
  picture.samples = kSamples;
  picture.bare = true;
  picture.bodies = {bodyRenderer.get(), bodies};
  const Image averaged = draw(*cpu, ball(), picture);
  picture.width *= kSamples;
  picture.height *= kSamples;
  picture.samples = 1;
  picture.bodies = {bodyRenderer.get(), bodies};
  const Drawn fine = drawSurface(*cpu, ball(), picture);
  int silhouettes = 0;
  for (int y = 0; y < averaged.height; ++y)
    for (int x = 0; x < averaged.width; ++x) {
      LinearColor sum = LinearColor::Zero();
      std::set<std::uint32_t> shown;
      for (int v = y * kSamples; v < (y + 1) * kSamples; ++v)
        for (int u = x * kSamples; u < (x + 1) * kSamples; ++u) {
          sum += decodeSrgb(fine.image.at(u, v));
          shown.insert(fine.buffers.body[std::size_t(v) * picture.width + u]);
        }
      silhouettes += shown.size() > 1;
      const Color expected = encodeSrgb(sum / (kSamples * kSamples));
      for (int k = 0; k < 3; ++k) ASSERT_NEAR(averaged.at(x, y)[k], expected[k], 2) << x << "," << y;
    }
  EXPECT_GT(silhouettes, 100);
}

TEST(BodyPictures, hideLinesOutlinesAndBoxesBehindBodies) {
  const auto cpu = makeCpuRenderer(ball());
  const auto bodyRenderer = makeCpuBodyRenderer({smallBox()});
  const std::vector<Body> bodies = {{0, placed(Vector3(0.2, 0.1, 2.4), 0.4)}};  // in front of the domain
  for (const CellStyle style : {CellStyle::none, CellStyle::lines, CellStyle::boxes}) {
    SurfacePicture picture{.camera = {.azimuthDegrees = 5, .elevationDegrees = 10},
                           .width = 200,
                           .height = 150,
                           .bare = true,
                           .plane = AxisPlane{2, 1.0},
                           .cells = {style, {}, {}}};
    picture.shadows = false;  // the surface and the body would throw them on each other
    picture.bodies = {bodyRenderer.get(), bodies};
    const Drawn drawn = drawSurface(*cpu, ball(), picture);
    picture.plane.reset();
    picture.surface = false;
    picture.cells.style = CellStyle::none;
    picture.bodies = {bodyRenderer.get(), bodies};
    const Drawn alone = drawSurface(*cpu, ball(), picture);
    int count = 0;
    for (std::size_t i = 0; i < alone.image.pixels.size(); ++i) {
      if (!alone.buffers.showsBody(i)) continue;
      ++count;
      ASSERT_TRUE(drawn.buffers.showsBody(i));
      EXPECT_LT(colorDifference(toOklab(decodeSrgb(drawn.image.pixels[i])), toOklab(decodeSrgb(alone.image.pixels[i]))),
                0.02);
    }
    EXPECT_GT(count, 400);
  }
}

TEST(BodyPictures, haveNoBodiesWithoutARenderer) {
  const auto cpu = makeCpuRenderer(ball());
  const Drawn drawn = drawSurface(*cpu, ball(), {.camera = {}, .width = 100, .height = 80});
  EXPECT_TRUE(drawn.buffers.body.empty());
  for (const std::string& detail : drawn.details) EXPECT_THAT(detail, testing::Not(HasSubstr("bod")));
}

TEST(BodyColors, differFromClayAndFromTheirNeighbours) {
  const Oklab clay = toOklab(decodeSrgb({210, 153, 119}));
  const auto lab = [](std::size_t i) { return toOklab(decodeSrgb(bodyColor(i))); };
  for (std::size_t i = 0; i < 1000; ++i) {
    EXPECT_GT(colorDifference(lab(i), clay), 0.09) << i;
    for (std::size_t next = 1; next <= 4; ++next) EXPECT_GT(colorDifference(lab(i), lab(i + next)), 0.05) << i;
  }
  EXPECT_EQ(bodyColor(7), bodyColor(7));
}

}  // namespace bodies_test
}  // namespace hpsdf::render
