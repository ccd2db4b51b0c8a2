#include "view/section.h"

#include <tbb/parallel_for.h>

#include <vector>

#include "view/grid_space.h"

namespace hpsdf::render {
namespace {

/// A plane across the rays of a view.
struct Sheet {
  Vector3 point;
  Vector3 normal;                      ///< unit
  Vector3 toLookUp = Vector3::Zero();  ///< from its points to where cell and value are looked up
};

/// Where a ray meets a sheet.
struct Meeting {
  std::size_t pixel;
  double distance;
  Vector3 point;
};

Sheet sheetAcross(int axis, double offset) { return {offset * Vector3::Unit(axis), Vector3::Unit(axis)}; }

/// The axis that a direction runs along, -1 for none.
int axisOf(const Vector3& direction) {
  for (int axis = 0; axis < 3; ++axis)
    if (direction[(axis + 1) % 3] == 0 && direction[(axis + 2) % 3] == 0) return axis;
  return -1;
}

/// Shows the sheet where `covers(meeting)`, within the domain, and then `keeps(value)`.
template <typename Covers, typename Keeps>
void addSheet(const Field& field, const Camera& camera, const Sheet& sheet, Shown shown, const Covers& covers,
              const Keeps& keeps, ViewBuffers& buffers) {
  prepareShown(buffers);
  const int axis = axisOf(sheet.normal);
  tbb::parallel_for(0, buffers.height, [&](int y) {
    std::vector<Meeting> meetings;
    std::vector<Vector3> points;
    for (int x = 0; x < buffers.width; ++x) {
      const Vector3 eye = pixelEye(camera, x, y, buffers.width, buffers.height);
      const Vector3 ray = pixelRay(camera, x, y, buffers.width, buffers.height);
      const double distance = sheet.normal.dot(sheet.point - eye) / sheet.normal.dot(ray);
      if (!(distance > 0)) continue;
      Vector3 point = eye + distance * ray;
      if (axis >= 0) point[axis] = sheet.point[axis];  // exactly: cells are half-open
      const Meeting meeting{std::size_t(y) * buffers.width + x, distance, point};
      if (!field.domain().contains(point) || !covers(meeting)) continue;
      meetings.push_back(meeting);
      points.push_back(point + sheet.toLookUp);
    }
    std::vector<double> values(points.size());
    field.values(points, values);
    for (std::size_t n = 0; n < meetings.size(); ++n) {
      if (!keeps(values[n])) continue;
      const std::size_t i = meetings[n].pixel;
      const Cell cell = field.cellAt(points[n]);
      const Vector3 ray = pixelRay(camera, int(i % buffers.width), y, buffers.width, buffers.height);
      buffers.cell[i] = cell.id;
      buffers.degree[i] = static_cast<std::uint8_t>(cell.degree);
      buffers.depth[i] = static_cast<std::uint8_t>(cell.depth);
      buffers.value[i] = static_cast<float>(values[n]);
      buffers.normal[i] = (sheet.normal.dot(ray) > 0 ? Vector3(-sheet.normal) : sheet.normal).cast<float>();
      buffers.distance[i] = static_cast<float>(meetings[n].distance);
      buffers.crack[i] = 0;
      buffers.shown[i] = shown;
    }
  });
}

}  // namespace

void addSection(const Field& field, const SurfaceView& view, ViewBuffers& buffers) {
  if (!view.clip) return;
  const int axis = view.clip->axis;
  Sheet sheet = sheetAcross(axis, view.clip->offset);
  const double nudge = kClipNudge * field.domain().sizes()[axis];
  sheet.toLookUp[axis] = eyeAbove(view.camera, *view.clip) ? -nudge : nudge;
  // rays start behind the plane: it lies before whatever they hit
  addSheet(
      field, view.camera, sheet, Shown::section, [](const Meeting&) { return true; },
      [&](double value) { return value < view.offset; }, buffers);
}

void addPlane(const Field& field, const SurfaceView& view, const SliceView& plane, ViewBuffers& buffers) {
  const Vector3 right = plane.right.normalized(), up = plane.up.normalized();
  const Sheet sheet{plane.origin, right.cross(up).normalized()};
  const bool above = view.clip && eyeAbove(view.camera, *view.clip);
  const auto removed = [&](const Vector3& point) {
    if (!view.clip) return false;
    const double beyond = point[view.clip->axis] - view.clip->offset;
    return above ? beyond > 0 : beyond < 0;
  };
  const auto covers = [&](const Meeting& m) {
    return !removed(m.point) && !(buffers.hit(m.pixel) && buffers.distance[m.pixel] <= static_cast<float>(m.distance));
  };
  addSheet(
      field, view.camera, sheet, Shown::plane, covers, [](double) { return true; }, buffers);
}

}  // namespace hpsdf::render
