#include "hpsdf/render/renderer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <thread>

#include "compare_buffers.h"
#include "hpsdf/build.h"
#include "hpsdf/error.h"
#include "hpsdf/shapes.h"
#include "picture/cracks.h"
#include "scene/section.h"
#include "support/random_field.h"
#include "support/require_gl.h"

namespace hpsdf::render {
namespace renderer_test {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr int kWidth = 160;
constexpr int kHeight = 120;

const Box kCube(Vector3(-1.1, -1.1, -1.1), Vector3(1.1, 1.1, 1.1));

/// Returns the field of a built-in shape, which is built only once for all tests.
const Field& shape(const std::string& spec) {
  static std::map<std::string, Field> fields;
  const auto found = fields.find(spec);
  if (found != fields.end()) return found->second;
  const BuildOptions options{.targetError = 1e-7, .estimator = Estimator::embedded};
  return fields.emplace(spec, build(shapes::analytic(spec), kCube, options)).first->second;
}

const std::vector<std::string> kShapes = {"sphere", "torus", "box"};

/// Tolerance for single precision, for fields with values of about 1.
constexpr BufferTolerance kSliceTolerance{.value = 2e-6};
/// Tolerance for surfaces; positions may differ by 1e-6 of the domain's diagonal.
BufferTolerance surfaceTolerance(const Field& field) {
  return {.value = 1e-5, .position = 1e-6 * field.domain().sizes().norm(), .normalAngle = 2e-3};
}

Camera lookingAt(const Vector3& eye, const Vector3& forward, double halfHeight) {
  const Vector3 unit = forward.normalized();
  const Vector3 right = unit.unitOrthogonal();
  return {eye, unit, right * (halfHeight * kWidth / kHeight), right.cross(unit) * halfHeight};
}

constexpr Projection kProjections[] = {Projection::perspective, Projection::orthographic};

/// Returns cameras of three kinds: orbits at random distances, eyes anywhere in the domain (also inside the solid), and
/// eyes near the surface that look along it. Cameras of the first two kinds also exist with orthographic projection.
std::vector<Camera> cameras(const Field& field, unsigned seed, int count) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal;
  const auto direction = [&] { return Vector3(normal(random), normal(random), normal(random)).normalized(); };
  const Box& domain = field.domain();
  const auto somewhere = [&] {
    return Vector3(domain.min() + domain.sizes().cwiseProduct(Vector3(unit(random), unit(random), unit(random))));
  };
  std::vector<Camera> result;
  for (int i = 0; i < count; ++i) {
    if (i % 3 == 0) {
      OrbitCamera orbit{.azimuthDegrees = 360 * unit(random),
                        .elevationDegrees = 180 * unit(random) - 90,
                        .distance = std::exp(4 * unit(random) - 2),
                        .fieldOfViewDegrees = 20 + 60 * unit(random)};
      for (const Projection projection : kProjections) {
        orbit.projection = projection;
        result.push_back(cameraOf(orbit, domain, kWidth, kHeight));
      }
    } else if (i % 3 == 1) {
      Camera camera = lookingAt(somewhere(), direction(), 0.2 + unit(random));
      for (const Projection projection : kProjections) {
        camera.projection = projection;
        result.push_back(camera);
      }
    } else {
      Vector3 eye = somewhere();
      for (int step = 0; step < 20; ++step) {
        const ValueAndGradient at = field.valueAndGradient(eye);
        eye -= (at.value - 1e-3) * at.gradient.normalized();
        eye = eye.cwiseMax(domain.min()).cwiseMin(domain.max());
      }
      const Vector3 away = field.valueAndGradient(eye).gradient.normalized();
      const Vector3 along = direction();
      result.push_back(lookingAt(eye, along - along.dot(away) * away, 0.1 + 0.5 * unit(random)));
    }
  }
  return result;
}

std::size_t hits(const ViewBuffers& buffers) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < buffers.cell.size(); ++i) count += buffers.hit(i);
  return count;
}

/// Counts the pixels that miss the surface between two hits in their row or column.
std::size_t gaps(const ViewBuffers& buffers) {
  std::size_t count = 0;
  const auto hit = [&](int x, int y) {
    return buffers.hit(std::size_t(y) * std::size_t(buffers.width) + std::size_t(x));
  };
  for (int y = 1; y + 1 < buffers.height; ++y)
    for (int x = 1; x + 1 < buffers.width; ++x)
      count += !hit(x, y) && ((hit(x - 1, y) && hit(x + 1, y)) || (hit(x, y - 1) && hit(x, y + 1)));
  return count;
}

Vector3 samplePoint(const SliceView& view, int width, int height, int x, int y) {
  return view.origin + view.right * ((x + 0.5) / width - 0.5) + view.up * (0.5 - (y + 0.5) / height);
}

// --- The oracle (double-precision CPU renderer) against the field itself --------------------------------------------

/// Expects that a slice has the cells, levels and values of the field's own queries at the samples' points. The view is
/// shifted a little within its plane, so that no row or column of samples runs along a face between cells.
void expectFieldsAnswers(const Field& field, SliceView view) {
  view.origin += 0.00137 * view.right + 0.00211 * view.up;
  const ViewBuffers buffers = makeCpuRenderer(field)->slice(view, kWidth, kHeight);
  ASSERT_EQ(buffers.cell.size(), std::size_t(kWidth) * kHeight);
  EXPECT_TRUE(buffers.normal.empty());
  int otherCells = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const std::size_t i = std::size_t(y) * kWidth + x;
      const Vector3 point = samplePoint(view, kWidth, kHeight, x, y);
      if (!buffers.hit(i)) {
        EXPECT_FALSE(field.domain().contains(point));
        EXPECT_EQ(buffers.degree[i] + buffers.depth[i] + buffers.value[i], 0);
        continue;
      }
      const Cell cell = field.cellAt(point);
      if (buffers.cell[i] != cell.id) {
        ++otherCells;  // the sample's point rounds differently in world and grid coordinates
        EXPECT_LT(cell.box.exteriorDistance(point) + 1e-12, 1e-9);
        continue;
      }
      EXPECT_EQ(buffers.degree[i], cell.degree);
      EXPECT_EQ(buffers.depth[i], cell.depth);
      EXPECT_NEAR(buffers.value[i], field.value(point), 1e-6);
    }
  EXPECT_LE(otherCells, kWidth * kHeight / 1000);
}

TEST(CpuSlice, hasTheFieldsValues) {
  for (const std::string& name : kShapes) {
    const Field& field = shape(name);
    for (int axis = 0; axis < 3; ++axis)
      for (const double offset : {0.0, 0.31, -1.1, 1.1})
        expectFieldsAnswers(field, axisSlice(field.domain(), axis, offset, kWidth, kHeight));
    expectFieldsAnswers(field, planeSlice(field.domain(), Vector3(0.1, 0.2, 0), Vector3(1, -2, 0.5), kWidth, kHeight));
  }
}

TEST(CpuSlice, showsTheUpperCellsInAPlaneOnFaces) {
  // The plane z = 0 is a face of base cells, because their number is even, and of their children.
  const Field& field = shape("torus");
  const ViewBuffers at = makeCpuRenderer(field)->slice(axisSlice(kCube, 2, 0, kWidth, kHeight), kWidth, kHeight);
  const ViewBuffers above = makeCpuRenderer(field)->slice(axisSlice(kCube, 2, 1e-9, kWidth, kHeight), kWidth, kHeight);
  const ViewBuffers below = makeCpuRenderer(field)->slice(axisSlice(kCube, 2, -1e-9, kWidth, kHeight), kWidth, kHeight);
  EXPECT_EQ(at.cell, above.cell);
  EXPECT_NE(at.cell, below.cell);
}

TEST(CpuSlice, acceptsBoxDomainsAndBothKindsOfCoefficients) {
  RandomFieldOptions options{.domain = Box(Vector3(-3, 10, 0.5), Vector3(4, 11, 2)), .grid = {5, 1, 3}};
  for (const bool single : {false, true}) {
    options.single = single;
    const Field field = randomField(3, options);
    expectFieldsAnswers(field, axisSlice(field.domain(), 0, 0.25, kWidth, kHeight));
    expectFieldsAnswers(field, planeSlice(field.domain(), field.domain().center(), Vector3(1, 1, 1), kWidth, kHeight));
  }
}

/// Returns the field of a torus with quantized coefficients.
Field quantizedTorus() {
  const auto torus = [](const Vector3& x) { return std::hypot(std::hypot(x.x(), x.y()) - 0.6, x.z()) - 0.3; };
  Field field = build(torus, kCube, {.targetError = 1e-5, .coefficients = CoefficientType::quantized});
  EXPECT_EQ(precisionName(field), "quantized");
  return field;
}

TEST(CpuSlice, acceptsQuantizedCoefficients) {
  const Field field = quantizedTorus();
  expectFieldsAnswers(field, axisSlice(field.domain(), 2, 0.25, kWidth, kHeight));
}

// --- The oracle's ray tracing against the exact surface --------------------------------------------------------------

/// Returns the distances at which a ray enters and leaves the box; empty if it misses the box.
std::optional<std::pair<double, double>> stretchWithin(const Box& box, const Vector3& eye, const Vector3& direction) {
  double first = 0;
  double last = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (box.min()[axis] - eye[axis]) / direction[axis];
    const double b = (box.max()[axis] - eye[axis]) / direction[axis];
    first = std::max(first, std::min(a, b));
    last = std::min(last, std::max(a, b));
  }
  if (!(first < last)) return std::nullopt;
  return std::pair(first, last);
}

/// Follows the ray of every 7th pixel in small steps: up to `nearHit` before its hit, measured across cell faces, which
/// a ray may meet at a shallow angle, or through the domain if there is no hit. `height(point)` minus the view's offset
/// must keep its sign, except for values below `tolerance`.
template <typename Height>
void expectNothingPassed(const Field& field, const SurfaceView& view, const ViewBuffers& buffers, int steps,
                         double tolerance, double nearHit, Height&& height) {
  for (std::size_t i = 0; i < buffers.cell.size(); i += 7) {
    const int x = static_cast<int>(i % buffers.width);
    const int y = static_cast<int>(i / buffers.width);
    const Vector3 eye = rayStart(view.camera, buffers.width, buffers.height, x, y);
    const Vector3 direction = rayDirection(view.camera, buffers.width, buffers.height, x, y);
    const auto stretch = stretchWithin(field.domain(), eye, direction);
    if (!stretch) {
      EXPECT_FALSE(buffers.hit(i));
      continue;
    }
    const auto [first, last] = *stretch;
    const double shallowest = std::max(0.02, direction.cwiseAbs().minCoeff());
    const double end = buffers.hit(i) ? buffers.distance[i] - nearHit / shallowest : last - 1e-9;
    const double start = height(eye + (first + 1e-9) * direction) - view.offset;
    if (std::abs(start) <= tolerance) continue;  // the ray starts on the surface
    for (int step = 1; step < steps; ++step) {
      const double t = first + 1e-9 + (end - first) * step / steps;
      if (t >= end) break;
      const double here = height(eye + t * direction) - view.offset;
      ASSERT_GT(start > 0 ? here : -here, -tolerance) << "pixel (" << x << ", " << y << ") at " << t << " of " << end;
    }
  }
}

TEST(CpuTrace, findsTheFirstCrossingOfTheField) {
  for (const std::string& name : kShapes) {
    const Field& field = shape(name);
    const auto renderer = makeCpuRenderer(field);
    std::size_t seen = 0;
    for (const Camera& camera : cameras(field, 11, 5))
      for (const double offset : {0.0, 0.05}) {
        const SurfaceView view{camera, offset};
        const ViewBuffers buffers = renderer->surface(view, kWidth, kHeight);
        seen += hits(buffers);
        expectNothingPassed(field, view, buffers, 500, 0, 1e-5, [&](const Vector3& p) { return field.value(p); });
      }
    EXPECT_GT(seen, std::size_t(kWidth) * kHeight);
  }
}

TEST(CpuTrace, findsTheFirstCrossingOfFieldsWithRandomCoefficients) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    const Field field = randomField(seed, {.roughness = seed % 2 ? 1.0 : 0.2, .maxDepth = 5, .maxDegree = 8});
    const auto renderer = makeCpuRenderer(field);
    for (const Camera& camera : cameras(field, seed, 6)) {
      const SurfaceView view{camera, 0};
      const ViewBuffers buffers = renderer->surface(view, kWidth, kHeight);
      expectNothingPassed(field, view, buffers, 500, 0, 1e-5, [&](const Vector3& p) { return field.value(p); });
    }
  }
}

TEST(ClippingPlane, removesTheHalfOnTheEyesSide) {
  const Field field = randomField(5, {.roughness = 0.05});
  const auto cpu = makeCpuRenderer(field);
  const auto gl = support::glProblem().empty() ? makeGlRenderer(field, support::testedGl()) : nullptr;
  std::size_t seen = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (const double offset : {-0.3, 0.0, 0.25, 2.0, -2.0})
      for (const double azimuth : {30.0, 200.0})
        for (const Projection projection : kProjections) {
          const OrbitCamera orbit{.azimuthDegrees = azimuth, .elevationDegrees = 25, .projection = projection};
          const Camera camera = cameraOf(orbit, field.domain(), kWidth, kHeight);
          const SurfaceView view{camera, 0, ClipPlane{axis, offset}};
          const ViewBuffers buffers = cpu->surface(view, kWidth, kHeight);
          const bool above =
              projection == Projection::perspective ? camera.eye[axis] >= offset : camera.forward[axis] < 0;
          for (std::size_t i = 0; i < buffers.cell.size(); ++i) {
            if (!buffers.hit(i)) continue;
            ++seen;
            EXPECT_LE((hitPoint(camera, buffers, i)[axis] - offset) * (above ? 1 : -1), 1e-5);
          }
          if (!gl) continue;
          EXPECT_TRUE(agree(buffers, gl->surface(view, kWidth, kHeight), surfaceTolerance(field), &camera))
              << axis << " " << offset << " " << azimuth;
        }
  EXPECT_GT(seen, 10000u);
  const Camera camera = cameraOf({}, field.domain(), kWidth, kHeight);
  EXPECT_THROW(cpu->surface({camera, 0, ClipPlane{0, std::nan("")}}, 8, 8), Error);
}

TEST(ClippingPlane, removesTheSameSideForParallelRaysAlongItAsInPerspective) {
  const Field field = randomField(5, {.roughness = 0.05});
  const auto cpu = makeCpuRenderer(field);
  for (const double azimuth : {-90.0, 90.0, 270.0})  // along x, up to rounding
    for (const double offset : {-0.1, 0.1}) {
      const OrbitCamera orbit{.azimuthDegrees = azimuth, .elevationDegrees = 0, .projection = Projection::orthographic};
      const Camera camera = cameraOf(orbit, field.domain(), kWidth, kHeight);
      const ViewBuffers buffers = cpu->surface({camera, 0, ClipPlane{2, offset}}, kWidth, kHeight);
      EXPECT_GT(hits(buffers), 500u);
      for (std::size_t i = 0; i < buffers.cell.size(); ++i) {
        if (!buffers.hit(i)) continue;
        const double z = hitPoint(camera, buffers, i).z();
        EXPECT_TRUE(offset > 0 ? z > offset : z < offset) << azimuth << " " << offset;
      }
    }
}

void expectSectionWhereTheSolidIsCut(Projection projection) {
  const Field field = randomField(5, {.roughness = 0.05});
  const Camera camera = cameraOf({.projection = projection}, field.domain(), kWidth, kHeight);
  const SurfaceView view{camera, 0, ClipPlane{2, 0.1}};
  ViewBuffers buffers = makeCpuRenderer(field)->surface(view, kWidth, kHeight);
  const ViewBuffers before = buffers;
  addSection(field, view, buffers);
  int inside = 0, outside = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const std::size_t i = std::size_t(y) * kWidth + x;
      const Vector3 eye = rayStart(camera, kWidth, kHeight, x, y);
      const Vector3 ray = rayDirection(camera, kWidth, kHeight, x, y);
      const Vector3 point = eye + (0.1 - eye.z()) / ray.z() * ray;
      const bool cut = field.domain().contains(point) && field.value({point.x(), point.y(), 0.1}) < 0;
      ASSERT_EQ(buffers.shows(i, Shown::section), cut);
      if (!cut) {
        ++outside;
        EXPECT_EQ(buffers.cell[i], before.cell[i]);
        continue;
      }
      ++inside;
      const Cell cell = field.cellAt({point.x(), point.y(), 0.1});
      EXPECT_EQ(buffers.cell[i], cell.id);
      EXPECT_EQ(buffers.degree[i], cell.degree);
      EXPECT_LT(buffers.value[i], 0);
      EXPECT_NEAR(buffers.distance[i], (point - eye).norm(), 1e-5);
      EXPECT_EQ(buffers.normal[i], Eigen::Vector3f::UnitZ());
    }
  EXPECT_GT(inside, 300);
  EXPECT_GT(outside, 300);
  ViewBuffers whole = before;
  addSection(field, {camera, 0}, whole);
  EXPECT_TRUE(whole.shown.empty());
}

TEST(Section, showsTheSolidWhereItIsCut) {
  for (const Projection projection : kProjections) expectSectionWhereTheSolidIsCut(projection);
}

/// Makes a field of one cell of degree 2 in [−1, 1]³. The linear terms of `c`, in lexicographic order, are 0.
Field quadratic(const std::vector<double>& c) {
  return Field({.domain = Box(-Vector3::Ones(), Vector3::Ones()),
                .nodes = {node::leaf(2, 0)},
                .coefficients = c,
                .metadata = {}});
}

struct Grazing {
  Field field;
  Vector3 direction;
};

/// Returns fields that are negative only in a thin layer in the middle of the domain, and the directions across the
/// layer. A ray comes from far above, and too long a step would carry it beyond the layer.
std::vector<Grazing> grazingFields(double dip) {
  // f = 3/2 u² − dip, and the same with v and with w
  std::vector<Grazing> result;
  const int places[] = {9, 5, 2};  // indices of the coefficients c_200, c_020, c_002
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> c(10, 0.0);
    c[0] = 0.5 - dip;
    c[places[axis]] = 1;
    result.push_back({quadratic(c), Vector3::Unit(axis)});
  }
  // f = −u·v − dip: along u = −v = s it is s² − dip.
  std::vector<double> c(10, 0.0);
  c[0] = -dip;
  c[8] = -1;
  result.push_back({quadratic(c), Vector3(1, -1, 0).normalized()});
  return result;
}

void expectGrazedSurfaceIsSeen(const std::function<std::unique_ptr<Renderer>(const Field&)>& make) {
  for (const double dip : {1e-5, 1e-3, 0.02, 0.05, 0.1})
    for (const Grazing& grazing : grazingFields(dip)) {
      const Camera camera = lookingAt(-3 * grazing.direction, grazing.direction, 0.01);
      const ViewBuffers buffers = make(grazing.field)->surface({camera, 0}, 16, 12);
      EXPECT_EQ(hits(buffers), buffers.cell.size()) << "a dip of " << dip << " is passed";
      for (std::size_t i = 0; i < buffers.cell.size(); ++i) {
        const Vector3 hit = hitPoint(camera, buffers, i);
        EXPECT_NEAR(grazing.field.value(hit), 0, 1e-5);
        EXPECT_LT(hit.dot(grazing.direction), 0) << "the first crossing is passed, dip " << dip;
      }
    }
}

TEST(CpuTrace, findsASurfaceThatIsGrazedTwiceWithinAStep) { expectGrazedSurfaceIsSeen(makeCpuRenderer); }

/// A ray must not pass the true surface by more than the field's error near the surface.
TEST(CpuTrace, neverPassesTheTrueSurfaceOfTheBuiltInShapes) {
  for (const std::string& name : kShapes) {
    const Field& field = shape(name);
    const DistanceFunction exact = shapes::analytic(name);
    const auto distance = [&](const Vector3& p) {
      double d = 0;
      exact(std::span(&p, 1), std::span(&d, 1));
      return d;
    };
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(-1.1, 1.1);
    double error = 0;
    for (int i = 0; i < 200000; ++i) {
      const Vector3 p(unit(random), unit(random), unit(random));
      const double d = distance(p);
      if (std::abs(d) < 0.02) error = std::max(error, std::abs(field.value(p) - d));
    }
    EXPECT_LT(error, 0.01) << name;
    const double tolerance = 1.5 * error + 1e-6;  // 1.5: the samples miss the largest error
    const auto renderer = makeCpuRenderer(field);
    for (const Camera& camera : cameras(field, 23, 15)) {
      const ViewBuffers buffers = renderer->surface({camera, 0}, kWidth, kHeight);
      expectNothingPassed(field, {camera, 0}, buffers, 300, tolerance, 0, distance);
      for (std::size_t i = 0; i < buffers.cell.size(); i += 7) {
        if (!buffers.hit(i)) continue;
        // If the ray starts within the error from the surface, it may already be on the other side in the field.
        if (std::abs(distance(rayStart(camera, kWidth, kHeight, int(i % kWidth), int(i / kWidth)))) > tolerance) {
          EXPECT_NEAR(distance(hitPoint(camera, buffers, i)), 0, tolerance) << name;
        }
      }
    }
  }
}

TEST(CpuTrace, hitsTheSphereWhereTheFormulaSays) {
  const double radius = 0.8;
  const Field& field = shape("sphere,radius=0.8");
  const Camera camera = cameraOf({}, kCube, kWidth, kHeight);
  const ViewBuffers buffers = makeCpuRenderer(field)->surface({camera, 0}, kWidth, kHeight);
  const auto gl = support::glProblem().empty() ? makeGlRenderer(field, support::testedGl()) : nullptr;
  const ViewBuffers other = gl ? gl->surface({camera, 0}, kWidth, kHeight) : buffers;
  int compared = 0;
  for (std::size_t i = 0; i < buffers.cell.size(); ++i) {
    const Vector3 direction = rayDirection(camera, kWidth, kHeight, int(i % kWidth), int(i / kWidth));
    const double toMiddle = -camera.eye.dot(direction);
    const double nearest2 = camera.eye.squaredNorm() - toMiddle * toMiddle;
    if (nearest2 > 1.01 * radius * radius) {
      EXPECT_FALSE(buffers.hit(i) || other.hit(i));
    }
    if (nearest2 > 0.98 * radius * radius) continue;
    const double expected = toMiddle - std::sqrt(radius * radius - nearest2);
    const Vector3 normal = (camera.eye + expected * direction).normalized();
    ASSERT_TRUE(buffers.hit(i) && other.hit(i));
    for (const ViewBuffers* b : {&buffers, &other}) {
      EXPECT_NEAR(b->distance[i], expected, 1e-3);
      EXPECT_LT((b->normal[i].cast<double>() - normal).norm(), 0.03);
      EXPECT_NEAR(b->value[i], 0, 1e-6);
    }
    ++compared;
  }
  EXPECT_GT(compared, 2000);
}

/// Parallel rays must hit the sphere where the formula says, with the same precision for any distance of the camera.
TEST(CpuTrace, hitsTheSphereOrthographically) {
  const double radius = 0.8;
  const Field& field = shape("sphere,radius=0.8");
  const auto cpu = makeCpuRenderer(field);
  const auto gl = support::glProblem().empty() ? makeGlRenderer(field, support::testedGl()) : nullptr;
  for (const double distance : {1.1, 1e7}) {
    // This makes the view equally high at the target for every distance.
    const double halfHeight = 1.1 * std::tan(17.5 * std::acos(-1.0) / 180) / distance;
    const OrbitCamera orbit{.distance = distance,
                            .fieldOfViewDegrees = 2 * std::atan(halfHeight) * 180 / std::acos(-1.0),
                            .projection = Projection::orthographic};
    const Camera camera = cameraOf(orbit, kCube, kWidth, kHeight);
    const ViewBuffers buffers = cpu->surface({camera, 0}, kWidth, kHeight);
    const ViewBuffers other = gl ? gl->surface({camera, 0}, kWidth, kHeight) : buffers;
    EXPECT_TRUE(agree(buffers, other, surfaceTolerance(field), &camera));
    int compared = 0;
    for (std::size_t i = 0; i < buffers.cell.size(); ++i) {
      const Vector3 start = rayStart(camera, kWidth, kHeight, int(i % kWidth), int(i / kWidth));
      const double toMiddle = -start.dot(camera.forward);
      const double nearest2 = start.squaredNorm() - toMiddle * toMiddle;
      if (nearest2 > 1.01 * radius * radius) {
        EXPECT_FALSE(buffers.hit(i) || other.hit(i));
      }
      if (nearest2 > 0.98 * radius * radius) continue;
      ASSERT_TRUE(buffers.hit(i) && other.hit(i));
      EXPECT_NEAR(buffers.distance[i], toMiddle - std::sqrt(radius * radius - nearest2), 1e-3);
      EXPECT_NEAR(field.value(hitPoint(camera, buffers, i)), 0, 1e-6);
      EXPECT_NEAR(field.value(hitPoint(camera, other, i)), 0, 1e-5);
      ++compared;
    }
    EXPECT_GT(compared, 2000) << distance;
  }
}

TEST(CpuTrace, startsInsideAndHandlesOffsetsAndTheDomainsBoundary) {
  const Field& field = shape("sphere,radius=0.8");
  const auto renderer = makeCpuRenderer(field);
  // A camera near the sphere's centre sees the sphere's inside in all directions.
  const Camera centered = lookingAt(Vector3(0.01, 0.02, 0.03), Vector3(1, 0, 0), 1);
  const ViewBuffers inside = renderer->surface({centered, 0}, kWidth, kHeight);
  EXPECT_EQ(hits(inside), inside.cell.size());
  EXPECT_NEAR(inside.distance[kWidth * kHeight / 2 + kWidth / 2], 0.79, 2e-3);
  EXPECT_GT(inside.normal[kWidth * kHeight / 2 + kWidth / 2].x(), 0.99);

  const Camera outside = lookingAt(Vector3(4, 0.01, 0.02), Vector3(-1, 0, 0), 0.1);
  const std::size_t middle = kWidth * kHeight / 2 + kWidth / 2;
  for (const double offset : {-0.3, 0.0, 0.2}) {
    const ViewBuffers buffers = renderer->surface({outside, offset}, kWidth, kHeight);
    ASSERT_TRUE(buffers.hit(middle));
    EXPECT_NEAR(buffers.distance[middle], 4 - 0.8 - offset, 2e-3);
    EXPECT_NEAR(buffers.value[middle], offset, 1e-6);
  }
  // In the domain's corners f is greatest, about 1.1·√3 − 0.8 ≈ 1.1: there is no surface at 1.5.
  EXPECT_EQ(hits(renderer->surface({outside, 1.5}, kWidth, kHeight)), 0u);
  // This camera looks away from the domain.
  EXPECT_EQ(hits(renderer->surface({lookingAt(Vector3(4, 0, 0), Vector3(1, 0, 0), 0.1), 0}, kWidth, kHeight)), 0u);
}

TEST(CpuRenderer, rejectsInvalidViews) {
  const Field field = randomField(1);
  const auto renderer = makeCpuRenderer(field);
  const SliceView slice = axisSlice(field.domain(), 2, 0, 8, 8);
  const Camera camera = cameraOf({}, field.domain(), 8, 8);
  EXPECT_THROW(renderer->slice(slice, 0, 8), Error);
  EXPECT_THROW(renderer->surface({camera, 0}, 8, -3), Error);
  EXPECT_THAT([&] { renderer->surface({camera, std::nan("")}, 8, 8); }, ThrowsMessage<Error>(HasSubstr("offset")));
  SliceView badSlice = slice;
  badSlice.up.x() = std::nan("");
  EXPECT_THROW(renderer->slice(badSlice, 8, 8), Error);
  Camera badCamera = camera;
  badCamera.forward.setZero();
  EXPECT_THAT([&] { renderer->surface({badCamera, 0}, 8, 8); }, ThrowsMessage<Error>(HasSubstr("forward")));
}

// --- Cracks --------------------------------------------------------------------------------------------------------

/// Coefficients of degree 2 in lexicographic order, for products of Legendre polynomials in local coordinates.
using Quadratic = std::array<double, 10>;

/// Makes 4 × 4 × 4 base cells in [−1, 1]³, some of them divided. `polynomial` returns a cell's coefficients for its
/// centre and half its edge length.
Field pieces(const std::function<Quadratic(const Vector3&, double)>& polynomial) {
  FieldData data{.domain = Box(-Vector3::Ones(), Vector3::Ones()),
                 .grid = {4, 4, 4},
                 .nodes = std::vector<std::uint64_t>(64),
                 .coefficients = {},
                 .metadata = {}};
  std::vector<double> coefficients;
  const auto leaf = [&](const Vector3& center, double half) {
    const Quadratic c = polynomial(center, half);
    coefficients.insert(coefficients.end(), c.begin(), c.end());
    return node::leaf(2, std::uint32_t(coefficients.size() - c.size()));
  };
  for (std::uint32_t i = 0; i < 64; ++i) {
    const Vector3 center = Vector3(i % 4, i / 4 % 4, i / 16) * 0.5 - Vector3::Constant(0.75);
    if (i % 3 != 0) {
      data.nodes[i] = leaf(center, 0.25);
      continue;
    }
    data.nodes[i] = node::internal(std::uint32_t(data.nodes.size()));
    for (int child = 0; child < 8; ++child)
      data.nodes.push_back(
          leaf(center + 0.125 * Vector3(child & 1 ? 1 : -1, child & 2 ? 1 : -1, child & 4 ? 1 : -1), 0.125));
  }
  data.coefficients = std::move(coefficients);
  return Field(std::move(data));
}

/// Returns the coefficients of value + slope · (x − center).
Quadratic linear(double value, const Vector3& slope, double half) {
  return {value, slope.z() * half, 0, slope.y() * half, 0, 0, slope.x() * half};
}

/// Returns the coefficients of (|x|² − r²) / 2r, which has slope 1 on the sphere of radius r.
Quadratic ball(double radius, const Vector3& center, double half) {
  Quadratic c = linear((center.squaredNorm() + half * half - radius * radius) / (2 * radius), center / radius, half);
  c[2] = c[5] = c[9] = half * half / (3 * radius);
  return c;
}

/// Returns the CPU renderer, and the OpenGL renderer if there is OpenGL.
std::vector<std::unique_ptr<Renderer>> renderersOf(const Field& field) {
  std::vector<std::unique_ptr<Renderer>> result;
  result.push_back(makeCpuRenderer(field));
  if (support::glProblem().empty()) result.push_back(makeGlRenderer(field, support::testedGl()));
  return result;
}

std::size_t crackCount(const ViewBuffers& buffers) {
  return std::size_t(std::ranges::count(buffers.crack, std::uint8_t{1}));
}

/// Continuous fields: one polynomial in all cells, a kink at faces, a surface that lies in cell faces, and solids that
/// extend beyond the domain, so that rays enter the domain inside them.
TEST(Cracks, areNoneInAContinuousField) {
  struct Continuous {
    const char* name;
    Field field;
  };
  const Continuous fields[] = {
      {"sphere", pieces([](const Vector3& c, double half) { return ball(0.8, c, half); })},
      {"ball beyond the walls", pieces([](const Vector3& c, double half) { return ball(1.2, c, half); })},
      {"plane in faces", pieces([](const Vector3& c, double half) { return linear(c.z(), Vector3::UnitZ(), half); })},
      {"oblique plane",
       pieces([](const Vector3& c, double half) { return linear(c.sum() - 0.3, Vector3::Ones(), half); })},
      {"kink", pieces([](const Vector3& c, double half) {
         return linear(c.z() + 0.5 * std::abs(c.x()), Vector3(c.x() < 0 ? -0.5 : 0.5, 0, 1), half);
       })},
  };
  for (const auto& [name, field] : fields) {
    std::vector<Camera> views = cameras(field, 41, 3);
    for (const double elevation : {-40.0, 0.0, 30.0, 90.0})
      for (const Projection projection : kProjections)
        views.push_back(
            cameraOf({.elevationDegrees = elevation, .projection = projection}, field.domain(), kWidth, kHeight));
    std::size_t seen = 0;
    for (const auto& renderer : renderersOf(field))
      for (const Camera& camera : views)
        for (const double offset : {0.0, 0.25}) {
          const ViewBuffers buffers = renderer->surface({camera, offset}, kWidth, kHeight);
          seen += hits(buffers);
          EXPECT_EQ(crackCount(buffers), 0u) << name << ", offset " << offset;
        }
    EXPECT_GT(seen, 20000u) << name;
  }
}

/// The field is z − 0.1 for x < 0, and z + 0.1 elsewhere: seen from above and +x, its surface has a cliff at x = 0.
TEST(Cracks, areExactlyWhereTheJumpIs) {
  const Field field = pieces(
      [](const Vector3& c, double half) { return linear(c.z() + (c.x() < 0 ? -0.1 : 0.1), Vector3::UnitZ(), half); });
  for (const Projection projection : kProjections) {
    OrbitCamera orbit{
        .azimuthDegrees = 60, .elevationDegrees = 25, .distance = 0.6, .up = UpAxis::z, .projection = projection};
    const Camera camera = cameraOf(orbit, field.domain(), kWidth, kHeight);
    for (const auto& renderer : renderersOf(field)) {
      const ViewBuffers buffers = renderer->surface({camera, 0}, kWidth, kHeight);
      int cliff = 0, others = 0;
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const std::size_t i = std::size_t(y) * kWidth + x;
          const Vector3 start = rayStart(camera, kWidth, kHeight, x, y);
          const Vector3 ray = rayDirection(camera, kWidth, kHeight, x, y);
          const Vector3 at = start - start.x() / ray.x() * ray;  // the ray's point at x = 0
          // All rays go down, so that a ray that is above the lower floor at x = 0 has met no surface before.
          const bool expected = ray.x() < 0 && field.domain().contains(at) && at.z() > -0.1 && at.z() < 0.1;
          if (std::abs(std::abs(at.z()) - 0.1) < 1e-4) continue;
          ASSERT_EQ(buffers.crack[i] != 0, expected) << x << ", " << y;
          if (!expected) {
            others += buffers.hit(i);
            continue;
          }
          ++cliff;
          ASSERT_TRUE(buffers.hit(i));
          EXPECT_NEAR(buffers.value[i], at.z() - 0.1, 1e-5);
          EXPECT_LT((hitPoint(camera, buffers, i) - at).norm(), 1e-4);
        }
      EXPECT_GT(cliff, 500);
      EXPECT_GT(others, 3000);
      const Cracks cracks = cracksOf(buffers, 0, 1);
      EXPECT_NEAR(double(cracks.pixels), cliff, 30);
      EXPECT_GT(cracks.widest, 0.195);
      EXPECT_LT(cracks.widest, 0.2 + 1e-5);
    }
    // From high above and from −x, the camera looks over the cliff and cannot see it.
    orbit.azimuthDegrees = -60;
    orbit.elevationDegrees = 50;
    orbit.distance = 0.25;
    const SurfaceView over{cameraOf(orbit, field.domain(), kWidth, kHeight), 0};
    for (const auto& renderer : renderersOf(field)) {
      const ViewBuffers buffers = renderer->surface(over, kWidth, kHeight);
      EXPECT_EQ(hits(buffers), buffers.cell.size());
      EXPECT_EQ(crackCount(buffers), 0u);
    }
  }
}

/// Tests steps slightly above and slightly below the height at which the ray march recognizes a crack.
TEST(Cracks, needALeastHeight) {
  const auto stepped = [](double step) {
    return pieces([step](const Vector3& c, double half) {
      return linear(c.x() + 0.5 * (c.x() < 0 ? -step : step), Vector3::UnitX(), half);
    });
  };
  const double diagonal = std::sqrt(12.0);
  const Camera camera = cameraOf({.azimuthDegrees = 80, .distance = 0.3}, kCube, kWidth, kHeight);
  const Field high = stepped(20e-6 * diagonal), low = stepped(2e-6 * diagonal);
  for (const auto& renderer : renderersOf(high)) {
    const ViewBuffers buffers = renderer->surface({camera, 0}, kWidth, kHeight);
    EXPECT_EQ(crackCount(buffers), buffers.crack.size());
  }
  for (const auto& renderer : renderersOf(low)) {
    const ViewBuffers buffers = renderer->surface({camera, 0}, kWidth, kHeight);
    EXPECT_EQ(hits(buffers), buffers.cell.size());
    EXPECT_EQ(crackCount(buffers), 0u);
  }
}

TEST(Cracks, areNotOnTheSectionOfAClippingPlane) {
  const Field field = randomField(5, {.roughness = 0.2});
  const SurfaceView view{cameraOf({}, field.domain(), kWidth, kHeight), 0, ClipPlane{2, 0.1}};
  ViewBuffers buffers = makeCpuRenderer(field)->surface(view, kWidth, kHeight);
  const std::size_t before = crackCount(buffers);
  addSection(field, view, buffers);
  EXPECT_LT(crackCount(buffers), before) << "no crack behind the section: the test shows nothing";
  for (std::size_t i = 0; i < buffers.crack.size(); ++i)
    EXPECT_FALSE(buffers.crack[i] && buffers.shows(i, Shown::section));
}

// --- OpenGL against the oracle -------------------------------------------------------------------------------------

class Gl : public testing::Test {
 protected:
  void SetUp() override { HPSDF_REQUIRE_GL(); }

  static void expectSameSlice(const Field& field, const SliceView& view, const BufferTolerance& tolerance,
                              int width = kWidth, int height = kHeight) {
    EXPECT_TRUE(agree(makeCpuRenderer(field)->slice(view, width, height),
                      makeGlRenderer(field, support::testedGl())->slice(view, width, height), tolerance));
  }
};

/// In single precision, squares of such lengths overflow or vanish.
TEST_F(Gl, drawsFieldsOfAnySizeAlike) {
  const Field field = randomField(5, {.roughness = 0.05});
  for (const double size : {0x1p-120, 0x1p-70, 0x1p70, 0x1p120}) {
    FieldData data = field.data();
    data.domain = Box(size * data.domain.min(), size * data.domain.max());
    for (double& c : std::get<FieldArray<double>>(data.coefficients).values()) c *= size;
    const Field sized(std::move(data));
    const auto one = makeGlRenderer(field, support::testedGl()), other = makeGlRenderer(sized, support::testedGl());
    const auto expectSame = [&](const ViewBuffers& expected, const ViewBuffers& found) {
      EXPECT_EQ(found.cell, expected.cell);
      EXPECT_EQ(found.normal, expected.normal);
      const auto expectTimes = [&](const std::vector<float>& lengths, const std::vector<float>& shown) {
        ASSERT_EQ(shown.size(), lengths.size());
        for (std::size_t i = 0; i < shown.size(); ++i) EXPECT_EQ(shown[i], float(size * double(lengths[i])));
      };
      expectTimes(expected.value, found.value);
      expectTimes(expected.distance, found.distance);
    };
    expectSame(one->slice(axisSlice(field.domain(), 2, 0.1, kWidth, kHeight), kWidth, kHeight),
               other->slice(axisSlice(sized.domain(), 2, size * 0.1, kWidth, kHeight), kWidth, kHeight));
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
      const auto view = [&](const Field& of, double scale) {
        return SurfaceView{cameraOf({.projection = projection}, of.domain(), kWidth, kHeight), scale * 0.05,
                           ClipPlane{2, scale * 0.1}};
      };
      const ViewBuffers expected = one->surface(view(field, 1), kWidth, kHeight);
      EXPECT_GT(hits(expected), std::size_t(kWidth) * kHeight / 20);
      expectSame(expected, other->surface(view(sized, size), kWidth, kHeight));
    }
  }
}

TEST_F(Gl, drawsSlicesOfBuiltInShapes) {
  BufferTolerance tolerance = kSliceTolerance;
  tolerance.pixels = 0;  // both renderers compute positions in double precision
  for (const std::string& name : kShapes) {
    const Field& field = shape(name);
    for (int axis = 0; axis < 3; ++axis)
      for (const double offset : {0.0, 0.37, -1.1, 1.1})
        expectSameSlice(field, axisSlice(kCube, axis, offset, kWidth, kHeight), tolerance);
    for (const Vector3& normal : {Vector3(1, 1, 1), Vector3(0.3, -2, 0.1), Vector3(1, 0, 1)})
      expectSameSlice(field, planeSlice(kCube, Vector3(0.1, 0, -0.2), normal, kWidth, kHeight), tolerance);
  }
}

TEST_F(Gl, drawsSlicesOfDegreesUpTo30) {
  for (const int degree : {0, 1, 2, 3, 4, 5, 13, 30}) {
    const Field field = randomField(degree, {.roughness = 1, .maxDepth = 1, .minDegree = degree, .maxDegree = degree});
    const ViewBuffers buffers =
        makeCpuRenderer(field)->slice(axisSlice(field.domain(), 2, 0.1, kWidth, kHeight), kWidth, kHeight);
    EXPECT_EQ(*std::max_element(buffers.degree.begin(), buffers.degree.end()), degree);
    expectSameSlice(field, axisSlice(field.domain(), 2, 0.1, kWidth, kHeight), {.value = 1e-5});
  }
}

TEST_F(Gl, drawsQuantizedCoefficients) {
  const Field field = quantizedTorus();
  expectSameSlice(field, axisSlice(field.domain(), 2, 0.1, kWidth, kHeight), {.value = 1e-5});
  const auto cpu = makeCpuRenderer(field), gl = makeGlRenderer(field, support::testedGl());
  for (const Camera& camera : cameras(field, 1, 2))
    EXPECT_TRUE(agree(cpu->surface({camera, 0}, kWidth, kHeight), gl->surface({camera, 0}, kWidth, kHeight),
                      surfaceTolerance(field), &camera));
}

TEST_F(Gl, drawsSlicesOfDeepOctreesAndBoxDomains) {
  // The view magnifies a corner of a tree of depth 12.
  const Field deep =
      randomField(4, {.grid = {3, 3, 3}, .refinement = 0.1, .maxDepth = 12, .deepAt = Vector3(0.1, 0.2, 0.3)});
  int depth = 0;
  Box deepest;
  deep.forEachCell([&](const Cell& cell) {
    if (cell.depth <= depth) return;
    depth = cell.depth;
    deepest = cell.box;
  });
  ASSERT_EQ(depth, 12);
  const SliceView close{deepest.center(), 40 * deepest.sizes().x() * Vector3::UnitX(),
                        30 * deepest.sizes().y() * Vector3::UnitY()};
  const ViewBuffers buffers = makeCpuRenderer(deep)->slice(close, kWidth, kHeight);
  EXPECT_EQ(*std::max_element(buffers.depth.begin(), buffers.depth.end()), depth);
  expectSameSlice(deep, close, kSliceTolerance);

  const Field box = randomField(6, {.domain = Box(Vector3(-3, 10, 0.5), Vector3(4, 11, 2)), .grid = {5, 1, 3}});
  expectSameSlice(box, axisSlice(box.domain(), 1, 10.5, kWidth, kHeight), kSliceTolerance);
  expectSameSlice(box, planeSlice(box.domain(), box.domain().center(), Vector3(1, 1, 1), kWidth, kHeight),
                  kSliceTolerance);
}

TEST_F(Gl, drawsViewsLargerThanATile) {
  const Field& field = shape("torus");
  expectSameSlice(field, axisSlice(kCube, 2, 0, 4500, 9), kSliceTolerance, 4500, 9);
  expectSameSlice(field, axisSlice(kCube, 2, 0, 5, 4500), kSliceTolerance, 5, 4500);
  const Camera camera = cameraOf({}, kCube, 2100, 64);
  EXPECT_TRUE(agree(makeCpuRenderer(field)->surface({camera, 0}, 2100, 64),
                    makeGlRenderer(field, support::testedGl())->surface({camera, 0}, 2100, 64), surfaceTolerance(field),
                    &camera));
}

TEST_F(Gl, drawsSurfacesOfBuiltInShapesFromAnywhere) {
  for (const std::string& name : kShapes) {
    const Field& field = shape(name);
    const auto cpu = makeCpuRenderer(field);
    const auto gl = makeGlRenderer(field, support::testedGl());
    std::size_t seen = 0;
    for (const Camera& camera : cameras(field, 31, 18))
      for (const double offset : {0.0, -0.04}) {
        const ViewBuffers expected = cpu->surface({camera, offset}, kWidth, kHeight);
        seen += hits(expected);
        EXPECT_TRUE(agree(expected, gl->surface({camera, offset}, kWidth, kHeight), surfaceTolerance(field), &camera))
            << name << " offset " << offset;
      }
    EXPECT_GT(seen, std::size_t(kWidth) * kHeight);
  }
}

/// Rays run along faces of cells: cameras are on the axes, and pictures have odd and even numbers of rows and columns.
TEST_F(Gl, drawsSurfacesSeenAlongAnAxis) {
  for (const std::string& name : kShapes) {
    const Field& field = shape(name);
    const auto cpu = makeCpuRenderer(field);
    const auto gl = makeGlRenderer(field, support::testedGl());
    struct Direction {
      int azimuth, elevation;
      Projection projection;
    };
    std::vector<Direction> directions;
    for (const auto& [azimuth, elevation] : {std::pair(0, 0), {90, 0}, {180, 0}, {270, 0}, {0, 90}, {0, -90}, {45, 0}})
      for (const Projection projection : kProjections) directions.push_back({azimuth, elevation, projection});
    for (const auto& [azimuth, elevation, projection] : directions)
      for (const auto& [width, height] : {std::pair(96, 64), {97, 65}, {160, 107}}) {
        const OrbitCamera orbit{
            .azimuthDegrees = double(azimuth), .elevationDegrees = double(elevation), .projection = projection};
        const Camera camera = cameraOf(orbit, field.domain(), width, height);
        const ViewBuffers expected = cpu->surface({camera, 0}, width, height);
        const ViewBuffers actual = gl->surface({camera, 0}, width, height);
        const std::string where = name + " from " + std::to_string(azimuth) + ", " + std::to_string(elevation) +
                                  (projection == Projection::perspective ? "" : ", orthographic");
        EXPECT_TRUE(agree(expected, actual, surfaceTolerance(field), &camera)) << where << ", width " << width;
        if (name == "torus") continue;  // its silhouette is not convex
        EXPECT_EQ(gaps(expected), 0u) << where << ", width " << width;
        EXPECT_EQ(gaps(actual), 0u) << where << ", width " << width;
      }
  }
}

TEST_F(Gl, findsASurfaceThatIsGrazedTwiceWithinAStep) {
  expectGrazedSurfaceIsSeen([](const Field& field) { return makeGlRenderer(field, support::testedGl()); });
}

TEST_F(Gl, drawsSurfacesOfFieldsWithRandomCoefficients) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    const Field field = randomField(
        seed,
        {.domain = Box(Vector3(-1, -1.5, -1), Vector3(1, 1, 1.2)), .grid = {2, 3, 2}, .roughness = 0.5, .maxDepth = 4});
    const auto cpu = makeCpuRenderer(field);
    const auto gl = makeGlRenderer(field, support::testedGl());
    // Many hits lie on faces between leaves, where f jumps over the offset. Their distance is less accurate, because
    // rays meet faces at shallow angles and the field is steep.
    BufferTolerance tolerance = surfaceTolerance(field);
    tolerance.value = 1e-4;
    tolerance.position *= 10;
    for (const Camera& camera : cameras(field, seed, 6))
      EXPECT_TRUE(agree(cpu->surface({camera, 0}, kWidth, kHeight), gl->surface({camera, 0}, kWidth, kHeight),
                        tolerance, &camera))
          << seed;
  }
}

/// At degree 30 the ray march takes many render passes (see shaders/surface_march.frag).
TEST_F(Gl, drawsSurfacesOfDegree30) {
  const Field field = randomField(9, {.grid = {1, 1, 1}, .maxDepth = 1, .minDegree = 30, .maxDegree = 30});
  const auto cpu = makeCpuRenderer(field);
  const auto gl = makeGlRenderer(field, support::testedGl());
  const Camera camera = cameraOf({}, field.domain(), 64, 48);
  const ViewBuffers expected = cpu->surface({camera, 0}, 64, 48);
  EXPECT_GT(hits(expected), 300u);
  EXPECT_TRUE(agree(expected, gl->surface({camera, 0}, 64, 48), surfaceTolerance(field), &camera));
}

/// The comparison must reject slightly wrong buffers: one coefficient of a visible cell is changed a little.
TEST_F(Gl, differsForAWrongField) {
  const Field field = randomField(2);
  const SliceView slice = axisSlice(field.domain(), 2, 0.1, kWidth, kHeight);
  const Camera camera = cameraOf({}, field.domain(), kWidth, kHeight);
  const ViewBuffers expectedSlice = makeCpuRenderer(field)->slice(slice, kWidth, kHeight);
  const ViewBuffers expectedSurface = makeCpuRenderer(field)->surface({camera, 0}, kWidth, kHeight);
  const auto rendered = [&](std::uint32_t cell, double change) {
    FieldData data = field.data();
    std::get<FieldArray<double>>(data.coefficients).values()[node::offset(data.nodes[cell])] += change;
    const Field changed(std::move(data));
    const auto gl = makeGlRenderer(changed, support::testedGl());
    return std::pair(gl->slice(slice, kWidth, kHeight), gl->surface({camera, 0}, kWidth, kHeight));
  };
  std::size_t hit = expectedSurface.cell.size() / 2 + kWidth / 2;
  while (!expectedSurface.hit(hit)) ++hit;
  std::size_t sliced = expectedSlice.cell.size() / 2 + kWidth / 2;
  while (!expectedSlice.hit(sliced)) ++sliced;

  const auto [sameSlice, sameSurface] = rendered(expectedSurface.cell[hit], 0);
  EXPECT_TRUE(agree(expectedSlice, sameSlice, kSliceTolerance));
  EXPECT_TRUE(agree(expectedSurface, sameSurface, surfaceTolerance(field), &camera));
  EXPECT_FALSE(agree(expectedSlice, rendered(expectedSlice.cell[sliced], 1e-5).first, kSliceTolerance));
  EXPECT_FALSE(
      agree(expectedSurface, rendered(expectedSurface.cell[hit], 2e-5).second, surfaceTolerance(field), &camera));
}

TEST_F(Gl, allowsSeveralRenderersAtOnceAndOnAnyThread) {
  const Field a = randomField(12);
  const Field b = randomField(13);
  const SliceView view = axisSlice(a.domain(), 1, 0.2, kWidth, kHeight);
  const ViewBuffers expectedA = makeCpuRenderer(a)->slice(view, kWidth, kHeight);
  const ViewBuffers expectedB = makeCpuRenderer(b)->slice(view, kWidth, kHeight);
  auto first = makeGlRenderer(a, support::testedGl());
  auto second = makeGlRenderer(b, support::testedGl());
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(agree(expectedA, first->slice(view, kWidth, kHeight), kSliceTolerance));
    EXPECT_TRUE(agree(expectedB, second->slice(view, kWidth, kHeight), kSliceTolerance));
  }
  first.reset();
  std::thread([&] { EXPECT_TRUE(agree(expectedB, second->slice(view, kWidth, kHeight), kSliceTolerance)); }).join();
  EXPECT_TRUE(agree(expectedB, second->slice(view, kWidth, kHeight), kSliceTolerance));
}

TEST_F(Gl, repeatsItselfBitByBit) {
  const Field& field = shape("torus");
  const SurfaceView view{cameraOf({}, kCube, kWidth, kHeight), 0};
  const auto gl = makeGlRenderer(field, support::testedGl());
  const ViewBuffers once = gl->surface(view, kWidth, kHeight);
  const ViewBuffers again = gl->surface(view, kWidth, kHeight);
  EXPECT_EQ(once.cell, again.cell);
  EXPECT_EQ(once.distance, again.distance);
  EXPECT_EQ(once.value, again.value);
}

TEST_F(Gl, namesItsDevice) {
  const bool isSoftware = support::testedGl() == GlChoice::software;
  EXPECT_EQ(glDescription(support::testedGl()).find("llvmpipe") != std::string::npos, isSoftware);
  const Field field = randomField(1);
  EXPECT_EQ(makeGlRenderer(field, support::testedGl())->description(), glDescription(support::testedGl()));
}

TEST_F(Gl, rejectsInvalidViews) {
  const Field field = randomField(1);
  const auto renderer = makeGlRenderer(field, support::testedGl());
  EXPECT_THROW(renderer->slice(axisSlice(field.domain(), 2, 0, 8, 8), 0, 8), Error);
  EXPECT_THROW(renderer->surface({cameraOf({}, field.domain(), 8, 8), std::nan("")}, 8, 8), Error);
}

/// A new process makes EGL search for drivers again and find none; the error must list everything that was tried.
TEST(GlDeathTest, namesTheDevicesTriedAndTheRemedyWithoutADriver) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto withoutDrivers = [](GlChoice choice) {
    ::setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json", 1);
    try {
      glDescription(choice);
    } catch (const Error& error) {
      std::fputs(error.what(), stderr);
      ::_exit(7);
    }
    ::_exit(0);
  };
  EXPECT_EXIT(withoutDrivers(GlChoice::software), testing::ExitedWithCode(7),
              "no OpenGL 4.5 through EGL on a software device \\(tried .*default display: .*\\): install libegl-mesa0 "
              "and libgl1-mesa-dri, or render on the CPU");
  EXPECT_EXIT(withoutDrivers(GlChoice::hardware), testing::ExitedWithCode(7),
              "on a hardware device \\(tried hardware devices: .*surfaceless Mesa: .*or render on the CPU");
}

/// The hardware device may be refused only if there is no graphics hardware; it must never be a software device.
TEST(GlHardware, isHardwareOrAnError) {
  try {
    EXPECT_THAT(glDescription(GlChoice::hardware), testing::Not(HasSubstr("llvmpipe")));
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("on a hardware device"));
    EXPECT_THAT(error.what(), HasSubstr("tried"));
  }
}

}  // namespace renderer_test
}  // namespace hpsdf::render
