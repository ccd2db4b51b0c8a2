#include "picture/scene.h"

#include <algorithm>

#include "scene/body_view.h"
#include "scene/cell_boxes.h"
#include "scene/cell_lines.h"
#include "scene/cell_selection.h"
#include "scene/section.h"
#include "view/view_buffers.h"
#include "view/view_checks.h"

namespace hpsdf::render {

bool Scene::showsField() const {
  return std::ranges::any_of(buffers.cell, [](std::uint32_t cell) { return cell != kNoCell; }) ||
         std::ranges::any_of(lines, [](float strength) { return strength > 0; });
}

Scene renderScene(Renderer& renderer, const Field& field, const SurfacePicture& picture, int width, int height,
                  double lineWidth) {
  checkOffset(picture.offset);
  checkClip(picture.clip);
  const ShownBodies& bodies = picture.bodies;
  Camera camera = cameraOf(picture.camera, field.domain(), width, height);
  // Parallel rays start before the domain; let them start before the bodies too.
  if (bodies.renderer) camera = startingBefore(bodies.renderer->bounds(bodies.bodies), camera);
  const SurfaceView view{camera, picture.offset, picture.clip};
  width *= picture.samples;
  height *= picture.samples;
  lineWidth *= picture.samples;

  Scene scene{view, picture.surface ? renderer.surface(view, width, height) : emptyBuffers(width, height, true)};
  if (picture.surface) addSection(field, view, scene.buffers);
  if (picture.plane) addPlane(field, view, sectionView(field.domain(), *picture.plane, 1, 1), scene.buffers);
  std::vector<Cell> cells;
  if (picture.cells.style != CellStyle::none) cells = chosenCells(field, picture.cells);
  if (picture.cells.style == CellStyle::boxes) addBoxes(field, view, cells, scene.buffers);
  if (bodies.renderer) addBodies(bodies.renderer->view(view.camera, bodies.bodies, width, height), scene.buffers);
  if (picture.cells.style == CellStyle::lines) scene.lines = cellLines(field, view, cells, scene.buffers, lineWidth);
  return scene;
}

SliceView sectionView(const Box& domain, const Plane& plane, int width, int height) {
  if (const auto* axis = std::get_if<AxisPlane>(&plane))
    return axisSlice(domain, axis->axis, axis->offset, width, height);
  const auto& free = std::get<FreePlane>(plane);
  return planeSlice(domain, free.point, free.normal, width, height);
}

}  // namespace hpsdf::render
