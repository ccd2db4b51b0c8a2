#include "scene/section.h"

#include <tbb/parallel_for.h>

#include <vector>

#include "view/grid_space.h"

namespace hpsdf::render {
namespace {

/// A plane that is shown in the picture of a surface.
struct ScenePlane {
  Vector3 point;
  Vector3 normal;                          ///< unit vector
  Vector3 lookupOffset = Vector3::Zero();  ///< added to points of the plane before cells and values are looked up
};

/// The intersection of a pixel's ray with a plane.
struct PlaneHit {
  std::size_t pixel;
  double distance;
  Vector3 point;
  Vector3 ray;  ///< unit direction of the ray
};

/// Shows the part of a plane within the domain, in pixels for which both `visible(hit)` and `keeps(value)` are true.
template <typename Visible, typename Keeps>
void addScenePlane(const Field& field, const Camera& camera, const ScenePlane& plane, Shown shown,
                   const Visible& visible, const Keeps& keeps, ViewBuffers& buffers) {
  prepareShown(buffers);
  const int axis = axisAlong(plane.normal);
  tbb::parallel_for(0, buffers.height, [&](int y) {
    std::vector<PlaneHit> hits;
    std::vector<Vector3> points;
    for (int x = 0; x < buffers.width; ++x) {
      const Vector3 eye = pixelEye(camera, x, y, buffers.width, buffers.height);
      const Vector3 ray = pixelRay(camera, x, y, buffers.width, buffers.height);
      const double distance = plane.normal.dot(plane.point - eye) / plane.normal.dot(ray);
      if (!(distance > 0)) continue;
      Vector3 point = eye + distance * ray;
      // Remove the rounding error perpendicular to an axis-aligned plane, because the plane may lie on a face between
      // cells.
      if (axis >= 0) point[axis] = plane.point[axis];
      const PlaneHit hit{std::size_t(y) * buffers.width + x, distance, point, ray};
      if (!field.domain().contains(point) || !visible(hit)) continue;
      hits.push_back(hit);
      points.push_back(point + plane.lookupOffset);
    }
    std::vector<double> values(points.size());
    field.values(points, values);
    for (std::size_t n = 0; n < hits.size(); ++n) {
      if (!keeps(values[n])) continue;
      const PlaneHit& hit = hits[n];
      showCell(field.cellAt(points[n]), shown, hit.distance, plane.normal, hit.ray, hit.pixel, buffers);
      buffers.value[hit.pixel] = static_cast<float>(values[n]);
    }
  });
}

}  // namespace

int axisAlong(const Vector3& direction) {
  for (int axis = 0; axis < 3; ++axis)
    if (direction[(axis + 1) % 3] == 0 && direction[(axis + 2) % 3] == 0) return axis;
  return -1;
}

void showCell(const Cell& cell, Shown shown, double distance, const Vector3& normal, const Vector3& ray,
              std::size_t pixel, ViewBuffers& buffers) {
  buffers.cell[pixel] = cell.id;
  buffers.degree[pixel] = static_cast<std::uint8_t>(cell.degree);
  buffers.depth[pixel] = static_cast<std::uint8_t>(cell.depth);
  buffers.normal[pixel] = (normal.dot(ray) > 0 ? Vector3(-normal) : normal).cast<float>();
  buffers.distance[pixel] = static_cast<float>(distance);
  buffers.crack[pixel] = 0;
  buffers.shown[pixel] = shown;
}

void addSection(const Field& field, const SurfaceView& view, ViewBuffers& buffers) {
  if (!view.clip) return;
  const auto [axis, offset] = *view.clip;
  ScenePlane plane{offset * Vector3::Unit(axis), Vector3::Unit(axis)};
  const double nudge = kClipNudge * field.domain().sizes()[axis];
  plane.lookupOffset[axis] = eyeAbove(view.camera, *view.clip) ? -nudge : nudge;
  // Show the section in all pixels that see it. Rays start behind the clipping plane, so that the section lies in front
  // of all hits of the surface.
  addScenePlane(
      field, view.camera, plane, Shown::section, [](const PlaneHit&) { return true; },
      [&](double value) { return value < view.offset; }, buffers);
}

void addPlane(const Field& field, const SurfaceView& view, const SliceView& plane, ViewBuffers& buffers) {
  const Vector3 right = plane.right.normalized(), up = plane.up.normalized();
  const bool above = view.clip && eyeAbove(view.camera, *view.clip);
  const auto clippedAway = [&](const Vector3& point) {
    if (!view.clip) return false;
    const double beyond = point[view.clip->axis] - view.clip->offset;
    return above ? beyond > 0 : beyond < 0;
  };
  const auto visible = [&](const PlaneHit& hit) {
    return !clippedAway(hit.point) &&
           !(buffers.hit(hit.pixel) && buffers.distance[hit.pixel] <= static_cast<float>(hit.distance));
  };
  addScenePlane(
      field, view.camera, {plane.origin, right.cross(up).normalized()}, Shown::plane, visible,
      [](double) { return true; }, buffers);
}

}  // namespace hpsdf::render
