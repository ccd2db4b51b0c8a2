#include "view/grid_space.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "hpsdf/error.h"
#include "view/view_buffers.h"

namespace hpsdf::render {
namespace {

void checkFinite(const Vector3& v, const char* what) {
  if (!v.allFinite()) throw Error(std::string("a view's ") + what + " is not finite: give finite numbers");
}

}  // namespace

void checkViewSize(int width, int height) {
  constexpr int kLargest = 1 << 20;
  if (std::min(width, height) < 1 || std::max(width, height) > kLargest)
    throw Error("a view of " + std::to_string(width) + "x" + std::to_string(height) +
                " pixels is out of range: give 1 to 2^20 pixels a side");
}

void checkCamera(const Camera& camera, int width, int height) {
  checkViewSize(width, height);
  checkFinite(camera.eye, "eye");
  checkFinite(camera.forward, "forward vector");
  checkFinite(camera.right, "right vector");
  checkFinite(camera.up, "up vector");
  if (camera.forward.isZero(0)) throw Error("a camera's forward vector is zero: give a direction to look along");
}

GridSpace::GridSpace(const FieldData& field)
    : lo(field.domain.min()),
      size(field.domain.max() - lo),
      grid(field.grid[0], field.grid[1], field.grid[2]),
      diagonal(size.norm()) {}

Vector3 GridSpace::point(const Vector3& x) const { return (x - lo).cwiseQuotient(size).cwiseProduct(grid); }

SliceGeometry::SliceGeometry(const GridSpace& space, const SliceView& view, int w, int h)
    : origin(space.point(view.origin)),
      right(space.direction(view.right)),
      up(space.direction(view.up)),
      width(w),
      height(h),
      stepX(0.5 / w),
      stepY(0.5 / h) {
  checkViewSize(w, h);
  checkFinite(view.origin, "origin");
  checkFinite(view.right, "right vector");
  checkFinite(view.up, "up vector");
  // a plane that lies in the domain's boundary may have been rounded to just outside
  for (int axis = 0; axis < 3; ++axis) {
    if (right[axis] != 0 || up[axis] != 0) continue;
    const double clamped = std::clamp(origin[axis], 0.0, space.grid[axis]);
    if (std::abs(origin[axis] - clamped) < 1e-12 * space.grid[axis]) origin[axis] = clamped;
  }
}

bool eyeAbove(const Camera& camera, const ClipPlane& clip) {
  constexpr double kAlong = 1e-9;  // of a direction: runs along the plane but for rounding
  const double ahead = camera.forward[clip.axis];
  if (camera.projection == Projection::orthographic && std::abs(ahead) > kAlong) return ahead < 0;
  return camera.eye[clip.axis] >= clip.offset;
}

RayGeometry::RayGeometry(const GridSpace& space, const Camera& camera, int w, int h,
                         const std::optional<ClipPlane>& clip)
    : parallel(camera.projection == Projection::orthographic),
      eye(space.point(camera.eye)),
      lo(Vector3::Zero()),
      hi(space.grid),
      forward(camera.forward),
      right(camera.right),
      up(camera.up),
      scale(space.grid.cwiseQuotient(space.size)),
      width(w),
      height(h),
      stepX(1.0 / w),
      stepY(1.0 / h) {
  checkCamera(camera, w, h);
  checkClip(clip);
  if (!clip) return;
  // a little within what is kept: a cut along faces then starts in cells on that side, in single precision too
  const bool above = eyeAbove(camera, *clip);
  const double cut = space.point(Vector3::Constant(clip->offset))[clip->axis];
  const double within = cut + (above ? -kClipNudge : kClipNudge) * space.grid[clip->axis];
  (above ? hi : lo)[clip->axis] = std::clamp(within, 0.0, space.grid[clip->axis]);
}

}  // namespace hpsdf::render
