#pragma once
// Grid coordinates, which both renderers use: the domain is [0, grid], and a base cell is a unit cube. Views
// are transformed to grid coordinates once, in double precision, so that CPU and GPU start from the same
// numbers.

#include <optional>

#include "hpsdf/field.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// The transform from world to grid coordinates. It rounds like the queries of a field, with operations in the same
/// order. Renderers and queries therefore put a plane through the middle of the domain on the same side of a face.
struct GridSpace {
  explicit GridSpace(const FieldData& field);

  Vector3 point(const Vector3& world) const { return (world - lo).cwiseQuotient(size).cwiseProduct(grid); }
  Vector3 direction(const Vector3& world) const { return world.cwiseQuotient(size).cwiseProduct(grid); }

  Vector3 lo;       ///< lower corner of the domain, world units
  Vector3 size;     ///< extent of the domain, world units
  Vector3 grid;     ///< number of base cells along each axis
  double diagonal;  ///< diagonal of the domain, world units
};

/// A slice in grid coordinates. Pixel (x, y) of w × h pixels samples the point (origin + right · (2x+1−w) · stepX) +
/// up · (h−2y−1) · stepY. This formula has only products and sums, which every IEEE device rounds in the same way.
struct SliceGeometry {
  SliceGeometry(const GridSpace& space, const SliceView& view, int width, int height);

  /// The point that a pixel samples.
  Vector3 point(int x, int y) const {
    return (origin + right * ((2 * x + 1 - width) * stepX)) + up * ((height - 2 * y - 1) * stepY);
  }

  Vector3 origin, right, up;
  int width, height;
  double stepX, stepY;  ///< 1/(2w), 1/(2h)
};

/// Distance behind a clipping plane at which rays start, as a share of the domain's extent perpendicular to the plane.
/// The cells that a section shows are looked up at the same distance behind the plane.
constexpr double kClipNudge = 1e-6;

/// Returns true if the eye is on a clipping plane's side of greater coordinates. The plane then removes this side.
bool eyeAbove(const Camera& camera, const ClipPlane& clip);

/// The rays of a camera. For pixel (x, y) of w × h pixels, let across = right · (2x+1−w) · stepX + up · (h−2y−1) ·
/// stepY. In perspective, the pixel's ray starts at the eye and runs along forward + across. A parallel ray starts at
/// eye + across · scale and runs along forward.
struct RayGeometry {
  RayGeometry(const GridSpace& space, const Camera& camera, int width, int height,
              const std::optional<ClipPlane>& clip = {});

  /// The start of a pixel's ray, grid coordinates.
  Vector3 start(int x, int y) const {
    return parallel ? Vector3(eye + onPicture(Vector3::Zero(), x, y).cwiseProduct(scale)) : eye;
  }

  /// The unit direction of a pixel's ray, in world coordinates.
  Vector3 direction(int x, int y) const {
    if (parallel) return forward;
    const Vector3 d = onPicture(forward, x, y);
    return d / d.norm();
  }

  bool parallel;               ///< whether rays are parallel: an orthographic view
  Vector3 eye;                 ///< the camera's eye, grid coordinates
  Vector3 lo, hi;              ///< corners of the visible part of the domain, grid coordinates
  Vector3 forward, right, up;  ///< vectors of the camera, world units
  Vector3 scale;               ///< grid coordinates per world unit
  int width, height;
  double stepX, stepY;  ///< 1/w, 1/h

 private:
  /// Adds to `middle` the vector from the centre of the picture to pixel (x, y), in world units.
  Vector3 onPicture(const Vector3& middle, int x, int y) const {
    return middle + right * ((2 * x + 1 - width) * stepX) + up * ((height - 2 * y - 1) * stepY);
  }
};

}  // namespace hpsdf::render
