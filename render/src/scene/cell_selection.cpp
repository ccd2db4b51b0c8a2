#include "scene/cell_selection.h"

#include <algorithm>

#include "view/grid_space.h"

namespace hpsdf::render {

std::vector<Cell> chosenCells(const Field& field, const ShownCells& choice) {
  const auto among = [](const std::vector<int>& levels, int level) {
    return levels.empty() || std::ranges::find(levels, level) != levels.end();
  };
  std::vector<Cell> cells;
  field.forEachCell([&](const Cell& cell) {
    if (among(choice.degrees, cell.degree) && among(choice.depths, cell.depth)) cells.push_back(cell);
  });
  return cells;
}

Box clipped(Box box, const SurfaceView& view) {
  if (!view.clip) return box;
  const auto [axis, offset] = *view.clip;
  if (eyeAbove(view.camera, *view.clip))
    box.max()[axis] = std::min(box.max()[axis], offset);
  else
    box.min()[axis] = std::max(box.min()[axis], offset);
  if (!(box.min()[axis] < box.max()[axis])) box.setEmpty();
  return box;
}

std::array<Vector3, 8> cornersOf(const Box& box) {
  std::array<Vector3, 8> corners;
  for (int i = 0; i < 8; ++i) corners[i] = box.corner(Box::CornerType(i));
  return corners;
}

}  // namespace hpsdf::render
