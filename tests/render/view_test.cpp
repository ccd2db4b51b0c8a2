#include "hpsdf/render/view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "hpsdf/error.h"

namespace hpsdf::render {
namespace view_test {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

const Box kBox(Vector3(-1, -2, 0), Vector3(3, 1, 2));  // size 4 × 3 × 2

Vector3 pixelCenter(const SliceView& view, int width, int height, int x, int y) {
  return view.origin + view.right * ((x + 0.5) / width - 0.5) + view.up * (0.5 - (y + 0.5) / height);
}

TEST(AxisSlice, hasItsAxesOnScreen) {
  const SliceView x = axisSlice(kBox, 0, 0.5, 200, 100);
  EXPECT_TRUE(x.right.normalized().isApprox(Vector3::UnitY()));
  EXPECT_TRUE(x.up.normalized().isApprox(Vector3::UnitZ()));
  const SliceView y = axisSlice(kBox, 1, 0.5, 200, 100);
  EXPECT_TRUE(y.right.normalized().isApprox(Vector3::UnitX()));
  EXPECT_TRUE(y.up.normalized().isApprox(Vector3::UnitZ()));
  const SliceView z = axisSlice(kBox, 2, 0.5, 200, 100);
  EXPECT_TRUE(z.right.normalized().isApprox(Vector3::UnitX()));
  EXPECT_TRUE(z.up.normalized().isApprox(Vector3::UnitY()));
}

TEST(AxisSlice, hasSquarePixelsAndTheSectionInTheMiddle) {
  for (const auto& [width, height] : {std::pair(640, 360), std::pair(100, 900), std::pair(1, 1)}) {
    for (int axis = 0; axis < 3; ++axis) {
      const SliceView view = axisSlice(kBox, axis, kBox.center()[axis], width, height);
      EXPECT_TRUE(view.origin.isApprox(kBox.center()));
      EXPECT_NEAR(view.right.norm() / width, view.up.norm() / height, 1e-12);
      const double filled = std::max(std::abs(view.right.normalized().dot(kBox.sizes())) / view.right.norm(),
                                     std::abs(view.up.normalized().dot(kBox.sizes())) / view.up.norm());
      EXPECT_GE(filled, 0.94);
      EXPECT_LE(filled, 0.96);
    }
  }
}

TEST(AxisSlice, hasEveryPixelExactlyOnThePlane) {
  for (const double offset : {0.0, 0.1, 2.0}) {
    const SliceView view = axisSlice(kBox, 2, offset, 33, 17);
    for (int y = 0; y < 17; ++y)
      for (int x = 0; x < 33; ++x) EXPECT_EQ(pixelCenter(view, 33, 17, x, y).z(), offset);
  }
}

TEST(AxisSlice, rejectsInvalidArguments) {
  EXPECT_THAT([] { axisSlice(kBox, 2, 2.001, 64, 64); }, ThrowsMessage<Error>(HasSubstr("outside of the domain")));
  EXPECT_THAT([] { axisSlice(kBox, 2, -0.001, 64, 64); }, ThrowsMessage<Error>(HasSubstr("give 0 to 2")));
  EXPECT_THROW(axisSlice(kBox, 2, kNaN, 64, 64), Error);
  EXPECT_THROW(axisSlice(kBox, 3, 0, 64, 64), Error);
  EXPECT_THROW(axisSlice(kBox, -1, 0, 64, 64), Error);
  EXPECT_THROW(axisSlice(kBox, 0, 0, 0, 64), Error);
  EXPECT_THROW(axisSlice(kBox, 0, 0, 64, -1), Error);
  EXPECT_THROW(axisSlice(Box(), 0, 0, 64, 64), Error);
}

TEST(PlaneSlice, acrossAnAxisIsTheAxisSlice) {
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {1.0, -3.0}) {
      const SliceView plane = planeSlice(kBox, Vector3(0.5, 0.25, 0.125), sign * Vector3::Unit(axis), 300, 200);
      const SliceView slice = axisSlice(kBox, axis, Vector3(0.5, 0.25, 0.125)[axis], 300, 200);
      EXPECT_EQ(plane.origin, slice.origin);
      EXPECT_EQ(plane.right, slice.right);
      EXPECT_EQ(plane.up, slice.up);
    }
}

TEST(PlaneSlice, showsTheWholeSectionAndLittleElse) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0, 1);
  for (int trial = 0; trial < 50; ++trial) {
    const Vector3 direction(normal(random), normal(random), normal(random));
    const Vector3 point = kBox.min() + kBox.sizes().cwiseProduct(Vector3(unit(random), unit(random), unit(random)));
    const SliceView view = planeSlice(kBox, point, direction, 400, 300);
    const Vector3 right = view.right.normalized();
    const Vector3 up = view.up.normalized();
    EXPECT_NEAR(right.dot(up), 0, 1e-12);
    EXPECT_NEAR(right.dot(direction.normalized()), 0, 1e-12);
    EXPECT_NEAR(up.dot(direction.normalized()), 0, 1e-12);
    EXPECT_NEAR(view.right.norm() / 400, view.up.norm() / 300, 1e-12);
    EXPECT_NEAR((view.origin - point).dot(direction.normalized()), 0, 1e-12);
    // A fine raster of a larger part of the plane: all points that lie in the box must be in the picture.
    double widest = 0;
    for (int i = 0; i <= 300; ++i)
      for (int j = 0; j <= 300; ++j) {
        const double a = 3 * (i / 300.0 - 0.5);
        const double b = 3 * (j / 300.0 - 0.5);
        if (!kBox.contains(Vector3(view.origin + a * view.right + b * view.up))) continue;
        widest = std::max({widest, std::abs(a), std::abs(b)});
      }
    EXPECT_LE(widest, 0.475 + 1e-9);
    EXPECT_GE(widest, 0.44);
  }
}

TEST(PlaneSlice, rejectsInvalidArguments) {
  const Vector3 inside = kBox.center();
  EXPECT_THAT([&] { planeSlice(kBox, inside, Vector3::Zero(), 64, 64); }, ThrowsMessage<Error>(HasSubstr("normal")));
  EXPECT_THROW(planeSlice(kBox, inside, Vector3(1, kNaN, 0), 64, 64), Error);
  EXPECT_THROW(planeSlice(kBox, Vector3(kInfinity, 0, 0), Vector3(1, 1, 0), 64, 64), Error);
  EXPECT_THAT([] { planeSlice(kBox, Vector3(9, 9, 9), Vector3(1, 1, 1), 64, 64); },
              ThrowsMessage<Error>(HasSubstr("misses the domain")));
  EXPECT_THROW(planeSlice(kBox, Vector3(0, 0, 2.5), Vector3::UnitZ(), 64, 64), Error);
  // This plane touches only a corner of the box.
  EXPECT_THROW(planeSlice(kBox, kBox.max(), Vector3(1, 1, 1), 64, 64), Error);
}

TEST(Camera, looksFromWhereTheAnglesSay) {
  const Box box(Vector3(-1, -1, -1), Vector3(1, 1, 1));
  const double diagonal = std::sqrt(12.0);
  OrbitCamera camera{.azimuthDegrees = 0, .elevationDegrees = 0, .distance = 2, .up = UpAxis::y};
  Camera view = cameraOf(camera, box, 100, 100);
  EXPECT_TRUE(view.eye.isApprox(Vector3(0, 0, 2 * diagonal)));
  EXPECT_TRUE(view.forward.isApprox(-Vector3::UnitZ()));
  EXPECT_TRUE(view.right.normalized().isApprox(Vector3::UnitX()));
  EXPECT_TRUE(view.up.normalized().isApprox(Vector3::UnitY()));

  camera.up = UpAxis::z;
  view = cameraOf(camera, box, 100, 100);
  EXPECT_TRUE(view.eye.isApprox(Vector3(0, -2 * diagonal, 0)));
  EXPECT_TRUE(view.right.normalized().isApprox(Vector3::UnitX()));
  EXPECT_TRUE(view.up.normalized().isApprox(Vector3::UnitZ()));

  camera.elevationDegrees = 90;
  view = cameraOf(camera, box, 100, 100);
  EXPECT_TRUE(view.eye.isApprox(Vector3(0, 0, 2 * diagonal)));
  EXPECT_TRUE(view.up.normalized().isApprox(Vector3::UnitY()));
}

TEST(Camera, circlesItsTarget) {
  const Vector3 target(0.3, -0.2, 0.7);
  const Camera view =
      cameraOf({.azimuthDegrees = 50, .elevationDegrees = 10, .distance = 0.1, .target = target}, kBox, 64, 64);
  EXPECT_NEAR((view.eye - target).norm(), 0.1 * kBox.sizes().norm(), 1e-12);
  EXPECT_TRUE(view.forward.isApprox((target - view.eye).normalized()));
  EXPECT_THROW(cameraOf({.target = Vector3(kNaN, 0, 0)}, kBox, 64, 64), Error);
}

TEST(Camera, hasOrthogonalRightHandedAxesScaledByTheFieldOfView) {
  for (const UpAxis up : {UpAxis::y, UpAxis::z})
    for (const double azimuth : {-200.0, 0.0, 30.0, 1000.0})
      for (const double elevation : {-90.0, -30.0, 0.0, 20.0, 90.0}) {
        const OrbitCamera camera{azimuth, elevation, 1.5, 40, up};
        const Camera view = cameraOf(camera, kBox, 300, 200);
        EXPECT_NEAR((view.eye - kBox.center()).norm(), 1.5 * kBox.sizes().norm(), 1e-9);
        EXPECT_NEAR(view.forward.norm(), 1, 1e-12);
        EXPECT_TRUE(view.right.normalized().cross(view.up.normalized()).isApprox(-view.forward, 1e-9));
        EXPECT_NEAR(view.up.norm(), std::tan(20 * std::acos(-1.0) / 180), 1e-12);
        EXPECT_NEAR(view.right.norm(), 1.5 * view.up.norm(), 1e-12);
        const Vector3 vertical = up == UpAxis::y ? Vector3::UnitY() : Vector3::UnitZ();
        EXPECT_NEAR((view.eye - kBox.center()).normalized().dot(vertical), std::sin(elevation * std::acos(-1.0) / 180),
                    1e-12);
      }
}

/// The plane through the target is shown as in perspective. Rays start in front of the domain, but not far from it.
TEST(OrthographicCamera, keepsTheFramingAndStartsBeforeTheDomain) {
  const double diagonal = kBox.sizes().norm();
  for (const double distance : {0.01, 1.1, 1e9})
    for (const Vector3& target : {Vector3(kBox.center()), Vector3(0.3, -0.2, 0.7), Vector3(50, -60, 70)})
      for (const double azimuth : {0.0, 33.0, 200.0})
        for (const double elevation : {-90.0, -20.0, 0.0, 60.0}) {
          OrbitCamera orbit{
              .azimuthDegrees = azimuth, .elevationDegrees = elevation, .distance = distance, .target = target};
          const Camera perspective = cameraOf(orbit, kBox, 300, 200);
          orbit.projection = Projection::orthographic;
          const Camera view = cameraOf(orbit, kBox, 300, 200);
          EXPECT_EQ(view.forward, perspective.forward);
          for (const auto& [x, y] : {std::pair(0, 0), {299, 0}, {10, 150}}) {
            const Vector3 ray = pixelRay(perspective, x, y, 300, 200);
            const double toTarget = distance * diagonal / ray.dot(view.forward);
            const Vector3 shown = pixelEye(perspective, x, y, 300, 200) + toTarget * ray;
            const Vector3 start = pixelEye(view, x, y, 300, 200);
            EXPECT_EQ(pixelRay(view, x, y, 300, 200), view.forward);
            const Vector3 across = shown - start - (shown - start).dot(view.forward) * view.forward;
            EXPECT_LT(across.norm(), 1e-9 * std::max(1.0, distance) * diagonal);
          }
          double nearest = kInfinity;
          for (int i = 0; i < 8; ++i) {
            const Vector3 corner = kBox.corner(static_cast<Box::CornerType>(i));
            nearest = std::min(nearest, (corner - view.eye).dot(view.forward));
          }
          EXPECT_GT(nearest, 0);
          EXPECT_LT(nearest, 0.05 * diagonal);
        }
}

TEST(Camera, projectsPointsToThePixelsThatSeeThem) {
  for (const Projection projection : {Projection::perspective, Projection::orthographic})
    for (const double distance : {0.6, 1.1, 4.0}) {
      const Camera view = cameraOf({.azimuthDegrees = 70,
                                    .elevationDegrees = -35,
                                    .distance = distance,
                                    .target = Vector3(0.2, 0.1, -0.3),
                                    .projection = projection},
                                   kBox, 300, 200);
      for (const auto& [x, y] : {std::pair(0, 0), {299, 199}, {140, 17}})
        for (const double along : {0.01, 1.0, 7.0}) {
          const Vector3 p = pixelEye(view, x, y, 300, 200) + along * pixelRay(view, x, y, 300, 200);
          const PicturePoint seen = project(view, p, 300, 200);
          EXPECT_NEAR(seen.x, x + 0.5, 1e-8);
          EXPECT_NEAR(seen.y, y + 0.5, 1e-8);
          EXPECT_NEAR(seen.distance, along, 1e-12);
          EXPECT_NEAR(seen.depth, (p - view.eye).dot(view.forward), 1e-12);
          const Vector3 pixelUp = p + pixelSize(view, seen.depth, 200) * view.up.normalized();
          EXPECT_NEAR(project(view, pixelUp, 300, 200).y, y - 0.5, 1e-8);
        }
      EXPECT_LT(project(view, view.eye - view.forward, 300, 200).depth, 0);
    }
}

TEST(Camera, rejectsNumbersOutOfRange) {
  const auto with = [](auto change) {
    OrbitCamera camera;
    change(camera);
    return [camera] { cameraOf(camera, kBox, 64, 64); };
  };
  EXPECT_THAT(with([](OrbitCamera& c) { c.azimuthDegrees = kNaN; }), ThrowsMessage<Error>(HasSubstr("azimuth")));
  EXPECT_THAT(with([](OrbitCamera& c) { c.elevationDegrees = 91; }), ThrowsMessage<Error>(HasSubstr("elevation 91")));
  EXPECT_THAT(with([](OrbitCamera& c) { c.distance = 0; }), ThrowsMessage<Error>(HasSubstr("distance")));
  EXPECT_THAT(with([](OrbitCamera& c) { c.distance = kInfinity; }), ThrowsMessage<Error>(HasSubstr("distance")));
  EXPECT_THAT(with([](OrbitCamera& c) { c.fieldOfViewDegrees = 180; }), ThrowsMessage<Error>(HasSubstr("view")));
  EXPECT_THROW(cameraOf({}, kBox, 0, 64), Error);
}

}  // namespace view_test
}  // namespace hpsdf::render
