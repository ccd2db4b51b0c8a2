#include "hpsdf/render/view.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "hpsdf/error.h"
#include "image/text.h"
#include "view/view_size.h"

namespace hpsdf::render {
namespace {

constexpr double kSectionMargin = 0.025;  // margin around the section, as a share of the picture's width or height
constexpr double kRayMargin = 0.01;       // distance from the start of parallel rays to the domain, in domain diagonals

std::string text(double x) { return printed("%.6g", x); }

void checkDomain(const Box& domain) {
  if (domain.isEmpty() || !domain.min().allFinite() || !domain.max().allFinite())
    throw Error("a view's domain is empty or not finite: give a field's domain");
}

/// A slice view with square pixels that shows the rectangle [lo, hi] of a plane. `lo` and `hi` are given along the unit
/// vectors `right` and `up`, from the point `base`.
SliceView framed(const Eigen::Vector2d& lo, const Eigen::Vector2d& hi, const Vector3& base, const Vector3& right,
                 const Vector3& up, int width, int height) {
  const Eigen::Vector2d center = 0.5 * (lo + hi);
  const Eigen::Vector2d extent = hi - lo;
  const double pixel = std::max(extent.x() / width, extent.y() / height) / (1 - 2 * kSectionMargin);
  return {base + center.x() * right + center.y() * up, right * (pixel * width), up * (pixel * height)};
}

/// The unit vectors that point right and up on the screen, for a plane with this normal. Up is the projection
/// of the z axis, or of the y axis if the plane is nearly horizontal. Right points towards growing coordinates,
/// so that the picture does not depend on the normal's sign.
std::pair<Vector3, Vector3> screenAxes(const Vector3& normal) {
  const Vector3 upwards = std::abs(normal.z()) > 0.9 ? Vector3::UnitY() : Vector3::UnitZ();
  const Vector3 up = (upwards - upwards.dot(normal) * normal).normalized();
  Vector3 right = up.cross(normal).normalized();
  Eigen::Index largest = 0;
  right.cwiseAbs().maxCoeff(&largest);
  if (right[largest] < 0) right = -right;
  return {right, up};
}

/// The intersections of a plane with the edges of a box, in no particular order. They are the corners of the
/// section of the box.
std::vector<Vector3> section(const Box& box, const Vector3& point, const Vector3& normal) {
  std::vector<Vector3> corners;
  for (int axis = 0; axis < 3; ++axis)
    for (int edge = 0; edge < 4; ++edge) {
      Vector3 a = box.min();
      a[(axis + 1) % 3] = edge & 1 ? box.max()[(axis + 1) % 3] : box.min()[(axis + 1) % 3];
      a[(axis + 2) % 3] = edge & 2 ? box.max()[(axis + 2) % 3] : box.min()[(axis + 2) % 3];
      Vector3 b = a;
      b[axis] = box.max()[axis];
      const double da = normal.dot(a - point);
      const double db = normal.dot(b - point);
      if (da == 0) corners.push_back(a);
      if (db == 0) corners.push_back(b);
      if ((da < 0 && db > 0) || (da > 0 && db < 0)) corners.push_back(a + (da / (da - db)) * (b - a));
    }
  return corners;
}

/// Adds to `middle` the vector from the centre of the picture to pixel (x, y).
Vector3 onPicture(const Camera& camera, const Vector3& middle, int x, int y, int width, int height) {
  return middle + camera.right * (2 * (x + 0.5) / width - 1) + camera.up * (1 - 2 * (y + 0.5) / height);
}

double radians(double degrees) { return degrees * (std::numbers::pi / 180); }

void checkRange(const char* what, double value, bool inRange, const char* range) {
  if (!std::isfinite(value) || !inRange)
    throw Error(std::string("camera ") + what + " " + text(value) + " is out of range: give " + range);
}

void checkOrbit(const OrbitCamera& camera) {
  checkRange("azimuth", camera.azimuthDegrees, true, "a finite angle in degrees");
  checkRange("elevation", camera.elevationDegrees, std::abs(camera.elevationDegrees) <= 90, "-90 to 90 degrees");
  checkRange("distance", camera.distance, camera.distance > 0, "a number above 0, in domain diagonals");
  checkRange("field of view", camera.fieldOfViewDegrees,
             camera.fieldOfViewDegrees > 0 && camera.fieldOfViewDegrees < 180, "more than 0 and less than 180 degrees");
  if (camera.target && !camera.target->allFinite())
    throw Error("the camera's target is not finite: give three coordinates");
}

}  // namespace

SliceView axisSlice(const Box& domain, int axis, double offset, int width, int height) {
  checkDomain(domain);
  checkViewSize(width, height);
  if (axis < 0 || axis > 2) throw Error("slice axis " + std::to_string(axis) + " is unknown: give 0, 1 or 2");
  const double lo = domain.min()[axis];
  const double hi = domain.max()[axis];
  if (!(offset >= lo && offset <= hi))
    throw Error("slice offset " + text(offset) + " lies outside of the domain: give " + text(lo) + " to " + text(hi));
  const int across = axis == 0 ? 1 : 0;
  const int upward = axis == 2 ? 1 : 2;
  return framed({domain.min()[across], domain.min()[upward]}, {domain.max()[across], domain.max()[upward]},
                offset * Vector3::Unit(axis), Vector3::Unit(across), Vector3::Unit(upward), width, height);
}

SliceView planeSlice(const Box& domain, const Vector3& point, const Vector3& normal, int width, int height) {
  checkDomain(domain);
  checkViewSize(width, height);
  if (!point.allFinite()) throw Error("the slice plane's point is not finite: give finite coordinates");
  if (!normal.allFinite() || normal.isZero(0))
    throw Error("the slice plane's normal is zero or not finite: give a direction");
  const auto misses = [&] {
    return Error("the slice plane through (" + text(point.x()) + ", " + text(point.y()) + ", " + text(point.z()) +
                 ") misses the domain: give a point within it");
  };
  // Treat a plane perpendicular to an axis separately, without rounding errors. If it lies on faces between cells, it
  // stays exactly on these faces.
  for (int axis = 0; axis < 3; ++axis) {
    if (normal[(axis + 1) % 3] != 0 || normal[(axis + 2) % 3] != 0) continue;
    if (!(point[axis] >= domain.min()[axis] && point[axis] <= domain.max()[axis])) throw misses();
    return axisSlice(domain, axis, point[axis], width, height);
  }
  const Vector3 unit = (normal / normal.cwiseAbs().maxCoeff()).normalized();
  const std::vector<Vector3> corners = section(domain, point, unit);
  if (corners.empty()) throw misses();
  const auto [right, up] = screenAxes(unit);
  // Measure coordinates in the plane from its point nearest to the centre of the domain, so that they stay small.
  const Vector3 base = domain.center() - unit.dot(domain.center() - point) * unit;
  Eigen::AlignedBox2d extent;
  for (const Vector3& corner : corners) extent.extend(Eigen::Vector2d(right.dot(corner - base), up.dot(corner - base)));
  if (!(extent.sizes().maxCoeff() > 1e-9 * domain.diagonal().norm())) throw misses();
  return framed(extent.min(), extent.max(), base, right, up, width, height);
}

Camera cameraOf(const OrbitCamera& camera, const Box& domain, int width, int height) {
  checkDomain(domain);
  checkViewSize(width, height);
  checkOrbit(camera);
  const double azimuth = radians(std::remainder(camera.azimuthDegrees, 360));
  const double elevation = radians(camera.elevationDegrees);
  const bool upY = camera.up == UpAxis::y;
  const Vector3 vertical = upY ? Vector3::UnitY() : Vector3::UnitZ();
  const Vector3 front = upY ? Vector3::UnitZ() : Vector3(-Vector3::UnitY());
  const Vector3 outward = std::sin(azimuth) * Vector3::UnitX() + std::cos(azimuth) * front;  // horizontal, to the eye
  const Vector3 right = std::cos(azimuth) * Vector3::UnitX() - std::sin(azimuth) * front;
  const Vector3 towardsEye = std::cos(elevation) * outward + std::sin(elevation) * vertical;
  const Vector3 up = std::cos(elevation) * vertical - std::sin(elevation) * outward;
  const double half = std::tan(0.5 * radians(camera.fieldOfViewDegrees));
  const double distance = camera.distance * domain.diagonal().norm();
  const Vector3 target = camera.target.value_or(domain.center());
  Camera result;
  result.eye = target + distance * towardsEye;
  result.forward = -towardsEye;
  const double shorter = std::min(width, height);
  result.right = right * (half * width / shorter);
  result.up = up * (half * height / shorter);
  if (camera.projection == Projection::orthographic) {
    result.right *= distance;
    result.up *= distance;
    const double toCorner =
        (domain.center() - target).dot(towardsEye) + 0.5 * domain.sizes().dot(towardsEye.cwiseAbs());
    result.eye = target + (toCorner + kRayMargin * domain.diagonal().norm()) * towardsEye;
    result.projection = Projection::orthographic;
  }
  return result;
}

Vector3 pixelPoint(const SliceView& view, int x, int y, int width, int height) {
  return view.origin + view.right * ((x + 0.5) / width - 0.5) + view.up * (0.5 - (y + 0.5) / height);
}

Vector3 pixelEye(const Camera& camera, int x, int y, int width, int height) {
  return camera.projection == Projection::orthographic ? onPicture(camera, camera.eye, x, y, width, height)
                                                       : camera.eye;
}

Vector3 pixelRay(const Camera& camera, int x, int y, int width, int height) {
  return camera.projection == Projection::orthographic
             ? camera.forward
             : onPicture(camera, camera.forward, x, y, width, height).normalized();
}

PicturePoint project(const Camera& camera, const Vector3& point, int width, int height) {
  const bool parallel = camera.projection == Projection::orthographic;
  const Vector3 from = point - camera.eye;
  const double depth = from.dot(camera.forward);
  const double scale = parallel ? 1 : depth;
  const double u = from.dot(camera.right) / (camera.right.squaredNorm() * scale);
  const double v = from.dot(camera.up) / (camera.up.squaredNorm() * scale);
  return {0.5 * (1 + u) * width, 0.5 * (1 - v) * height, depth, parallel ? depth : from.norm()};
}

double pixelSize(const Camera& camera, double depth, int height) {
  const double size = 2 * camera.up.norm() / height;
  return camera.projection == Projection::orthographic ? size : size * depth;
}

Vector3 pointAt(const SliceView& view, const ViewBuffers& buffers, int x, int y) {
  return pixelPoint(view, x, y, buffers.width, buffers.height);
}

Vector3 pointAt(const SurfaceView& view, const ViewBuffers& buffers, int x, int y) {
  return pixelEye(view.camera, x, y, buffers.width, buffers.height) +
         pixelRay(view.camera, x, y, buffers.width, buffers.height) *
             buffers.distance[std::size_t(y) * buffers.width + x];
}

}  // namespace hpsdf::render
