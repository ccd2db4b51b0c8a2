#pragma once
// Grid coordinates, in which both renderers work: the domain is [0, grid], a base cell a unit cube. Views are turned
// into grid coordinates here, once and in double precision, so that CPU and GPU start from the same numbers.

#include <optional>

#include "hpsdf/field.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Throws `Error` for a width or height below 1 or above 2^20.
void checkViewSize(int width, int height);

/// Throws `Error` for a size as above, or a camera that is not finite or looks nowhere.
void checkCamera(const Camera& camera, int width, int height);

/// World to grid coordinates; in the order of operations of core's queries, so that a plane through the middle of the
/// domain lands on the same side of a face.
struct GridSpace {
  explicit GridSpace(const FieldData& field);

  Vector3 point(const Vector3& x) const;
  Vector3 direction(const Vector3& d) const { return d.cwiseQuotient(size).cwiseProduct(grid); }

  Vector3 lo;    ///< corner of the domain, world units
  Vector3 size;  ///< of the domain, world units
  Vector3 grid;  ///< base cells an axis
  double diagonal;
};

/// A slice in grid coordinates. Pixel (x, y) samples (origin + right · (2x+1−w) · stepX) + up · (h−2y−1) · stepY: only
/// products and sums, which every IEEE device rounds alike.
struct SliceGeometry {
  SliceGeometry(const GridSpace& space, const SliceView& view, int width, int height);

  Vector3 point(int x, int y) const {
    return (origin + right * ((2 * x + 1 - width) * stepX)) + up * ((height - 2 * y - 1) * stepY);
  }

  Vector3 origin, right, up;
  int width, height;
  double stepX, stepY;  ///< 1/(2w), 1/(2h)
};

/// How far behind a clipping plane one looks, in parts of the domain.
constexpr double kClipNudge = 1e-6;

/// Whether the eye is on the side of greater coordinates of a clipping plane.
bool eyeAbove(const Camera& camera, const ClipPlane& clip);

/// The rays of a camera. With across = right · (2x+1−w) · stepX + up · (h−2y−1) · stepY, pixel (x, y) looks from the
/// eye along forward + across or, where rays are parallel, from eye + across along forward; across and directions in
/// world units, which `scale` takes to grid coordinates.
struct RayGeometry {
  RayGeometry(const GridSpace& space, const Camera& camera, int width, int height,
              const std::optional<ClipPlane>& clip = {});

  /// Where the pixel's ray starts, grid coordinates.
  Vector3 start(int x, int y) const {
    return parallel ? Vector3(eye + onPicture(Vector3::Zero(), x, y).cwiseProduct(scale)) : eye;
  }

  /// World units, unit.
  Vector3 direction(int x, int y) const {
    if (parallel) return forward;
    const Vector3 d = onPicture(forward, x, y);
    return d / d.norm();
  }

  bool parallel;               ///< rays: orthographic
  Vector3 eye;                 ///< grid coordinates
  Vector3 lo, hi;              ///< what of the domain is shown, grid coordinates
  Vector3 forward, right, up;  ///< world units
  Vector3 scale;
  int width, height;
  double stepX, stepY;  ///< 1/w, 1/h

 private:
  Vector3 onPicture(const Vector3& middle, int x, int y) const {
    return middle + right * ((2 * x + 1 - width) * stepX) + up * ((height - 2 * y - 1) * stepY);
  }
};

}  // namespace hpsdf::render
