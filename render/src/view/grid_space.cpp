#include "view/grid_space.h"

#include <algorithm>
#include <cmath>

#include "view/view_checks.h"
#include "view/view_size.h"

namespace hpsdf::render {

GridSpace::GridSpace(const FieldData& field)
    : lo(field.domain.min()),
      size(field.domain.max() - lo),
      grid(field.grid[0], field.grid[1], field.grid[2]),
      diagonal(size.norm()) {}

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
  // Rounding may have moved a plane in the boundary of the domain to just outside of the domain. Move it back.
  for (int axis = 0; axis < 3; ++axis) {
    if (right[axis] != 0 || up[axis] != 0) continue;
    const double clamped = std::clamp(origin[axis], 0.0, space.grid[axis]);
    if (std::abs(origin[axis] - clamped) < 1e-12 * space.grid[axis]) origin[axis] = clamped;
  }
}

bool eyeAbove(const Camera& camera, const ClipPlane& clip) {
  constexpr double kParallel = 1e-9;  // components of a unit direction up to this size count as 0
  const double ahead = camera.forward[clip.axis];
  if (camera.projection == Projection::orthographic && std::abs(ahead) > kParallel) return ahead < 0;
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
  // Let the visible part of the domain end slightly behind the clipping plane. If the plane lies along faces of cells,
  // rays then start in a cell behind the plane in single precision too.
  const bool above = eyeAbove(camera, *clip);
  const double cut = space.point(Vector3::Constant(clip->offset))[clip->axis];
  const double behind = cut + (above ? -kClipNudge : kClipNudge) * space.grid[clip->axis];
  (above ? hi : lo)[clip->axis] = std::clamp(behind, 0.0, space.grid[clip->axis]);
}

}  // namespace hpsdf::render
