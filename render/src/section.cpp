#include "section.h"

#include <tbb/parallel_for.h>

#include <vector>

#include "grid_space.h"

namespace hpsdf::render {

void addSection(const Field& field, const SurfaceView& view, ViewBuffers& buffers) {
  if (!view.clip) return;
  buffers.section.assign(buffers.cell.size(), 0);
  const Camera& camera = view.camera;
  const int axis = view.clip->axis;
  const bool above = eyeAbove(camera, *view.clip);
  const double nudge = kClipNudge * field.domain().sizes()[axis];
  const double behind = view.clip->offset + (above ? -nudge : nudge);
  Eigen::Vector3f towardsEye = Eigen::Vector3f::Zero();
  towardsEye[axis] = above ? 1.0F : -1.0F;
  tbb::parallel_for(0, buffers.height, [&](int y) {
    struct Cut {
      std::size_t pixel;
      double distance;
    };
    std::vector<Cut> cuts;
    std::vector<Vector3> points;
    for (int x = 0; x < buffers.width; ++x) {
      const Vector3 eye = pixelEye(camera, x, y, buffers.width, buffers.height);
      const Vector3 ray = pixelRay(camera, x, y, buffers.width, buffers.height);
      const double distance = (view.clip->offset - eye[axis]) / ray[axis];
      if (!(distance > 0)) continue;
      Vector3 point = eye + distance * ray;
      if (!field.domain().contains(point)) continue;
      point[axis] = behind;
      cuts.push_back({std::size_t(y) * buffers.width + x, distance});
      points.push_back(point);
    }
    std::vector<double> values(points.size());
    field.values(points, values);
    for (std::size_t n = 0; n < cuts.size(); ++n) {
      if (!(values[n] < view.offset)) continue;
      const std::size_t i = cuts[n].pixel;
      const Cell cell = field.cellAt(points[n]);
      buffers.cell[i] = cell.id;
      buffers.degree[i] = static_cast<std::uint8_t>(cell.degree);
      buffers.depth[i] = static_cast<std::uint8_t>(cell.depth);
      buffers.value[i] = static_cast<float>(values[n]);
      buffers.normal[i] = towardsEye;
      buffers.distance[i] = static_cast<float>(cuts[n].distance);
      buffers.crack[i] = 0;
      buffers.section[i] = 1;
    }
  });
}

}  // namespace hpsdf::render
