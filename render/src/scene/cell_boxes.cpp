#include "scene/cell_boxes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "scene/pixel_rows.h"
#include "scene/section.h"
#include "view/grid_space.h"

namespace hpsdf::render {
namespace {

/// The pixels that may see a box.
PixelRect rectOf(const Box& box, const Camera& camera, int width, int height) {
  std::array<PicturePoint, 8> corners;
  std::ranges::transform(cornersOf(box), corners.begin(),
                         [&](const Vector3& corner) { return project(camera, corner, width, height); });
  return pixelsAround(corners, std::numeric_limits<double>::min(), width, height);
}

struct BoxRay {
  Vector3 start, direction, inverse;
};

BoxRay rayOf(const Camera& camera, int x, int y, int width, int height) {
  BoxRay ray{pixelEye(camera, x, y, width, height), pixelRay(camera, x, y, width, height), {}};
  // For a direction component of zero the inverse is very large instead of infinite, because infinity times 0 is
  // NaN.
  for (int axis = 0; axis < 3; ++axis)
    ray.inverse[axis] = 1 / (ray.direction[axis] != 0 ? ray.direction[axis] : 1e-200);
  return ray;
}

/// The point at which a ray enters a box.
struct Entry {
  double distance;
  int axis;  ///< axis perpendicular to the face through which the ray enters
};

/// The point at which a ray that starts outside of a box enters the box. Returns std::nullopt if the ray misses
/// the box.
std::optional<Entry> enter(const BoxRay& ray, const Box& box) {
  const Vector3 a = (box.min() - ray.start).cwiseProduct(ray.inverse);
  const Vector3 b = (box.max() - ray.start).cwiseProduct(ray.inverse);
  const Vector3 near = a.cwiseMin(b);
  Entry entry{near.x(), 0};
  for (int axis = 1; axis < 3; ++axis)
    if (near[axis] > entry.distance) entry = {near[axis], axis};
  if (!(entry.distance > 0) || entry.distance > a.cwiseMax(b).minCoeff()) return std::nullopt;
  return entry;
}

/// A box that is drawn for a cell.
struct CellBox {
  Box box;
  const Cell* cell;
  double squaredDistance;  ///< squared distance of the box from the eye
};

/// The boxes to draw for the cells, from near to far, because near boxes hide most of the others.
std::vector<CellBox> boxesOf(const SurfaceView& view, const std::vector<Cell>& cells) {
  const Camera& camera = view.camera;
  std::vector<CellBox> boxes;
  for (const Cell& cell : cells) {
    const Vector3 half = 0.5 * kBoxShare * cell.box.sizes();
    const Box box = clipped(Box(cell.box.center() - half, cell.box.center() + half), view);
    const bool containsEye = camera.projection == Projection::perspective && box.contains(camera.eye);
    if (!box.isEmpty() && !containsEye) boxes.push_back({box, &cell, box.squaredExteriorDistance(camera.eye)});
  }
  std::ranges::stable_sort(boxes, {}, &CellBox::squaredDistance);
  return boxes;
}

/// Sets the field's value in the pixels that show boxes. `rays` are the rays of the pixels from row y0 on.
void addValues(const Field& field, int y0, const std::vector<BoxRay>& rays, ViewBuffers& buffers) {
  const std::size_t first = std::size_t(y0) * buffers.width;
  std::vector<std::size_t> pixels;
  std::vector<Vector3> points;
  for (std::size_t n = 0; n < rays.size(); ++n) {
    if (!buffers.shows(first + n, Shown::box)) continue;
    pixels.push_back(first + n);
    points.push_back(rays[n].start + double(buffers.distance[first + n]) * rays[n].direction);
  }
  std::vector<double> values(points.size());
  field.values(points, values);
  for (std::size_t n = 0; n < pixels.size(); ++n) buffers.value[pixels[n]] = static_cast<float>(values[n]);
}

/// Removes the cells that the surface f = offset does not cross, as far as 4 × 4 × 4 points of each cell tell.
void keepCrossed(const Field& field, double offset, std::vector<Cell>& cells) {
  constexpr int kPoints = 4;
  constexpr double kInset = 1e-6;  // share of the cell by which its outermost points lie within it
  std::vector<std::uint8_t> crossed(cells.size());
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t n) {
    std::array<Vector3, kPoints * kPoints * kPoints> points;
    std::array<double, points.size()> values;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vector3 t(double(i % kPoints), double(i / kPoints % kPoints), double(i / (kPoints * kPoints)));
      const Vector3 inside = (t / (kPoints - 1)).cwiseMax(kInset).cwiseMin(1 - kInset);
      points[i] = cells[n].box.min() + inside.cwiseProduct(cells[n].box.sizes());
    }
    field.values(points, values);
    const auto [low, high] = std::ranges::minmax(values);
    crossed[n] = low <= offset && high >= offset;
  });
  std::size_t kept = 0;
  for (std::size_t n = 0; n < cells.size(); ++n)
    if (crossed[n] != 0) cells[kept++] = cells[n];
  cells.erase(cells.begin() + std::ptrdiff_t(kept), cells.end());
}

}  // namespace

std::vector<Cell> chosenCells(const Field& field, const ShownCells& choice, double offset) {
  const auto among = [](const std::vector<int>& levels, int level) {
    return levels.empty() || std::ranges::find(levels, level) != levels.end();
  };
  std::vector<Cell> cells;
  field.forEachCell([&](const Cell& cell) {
    if (among(choice.degrees, cell.degree) && among(choice.depths, cell.depth)) cells.push_back(cell);
  });
  if (choice.atSurface) keepCrossed(field, offset, cells);
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

void addBoxes(const Field& field, const SurfaceView& view, const std::vector<Cell>& cells, ViewBuffers& buffers) {
  prepareShown(buffers);
  const int width = buffers.width, height = buffers.height;
  const std::vector<CellBox> boxes = boxesOf(view, cells);
  std::vector<PixelRect> rects(boxes.size());
  tbb::parallel_for(std::size_t{0}, boxes.size(),
                    [&](std::size_t n) { rects[n] = rectOf(boxes[n].box, view.camera, width, height); });
  forEachStrip(height, rects, [&](int y0, int y1, const std::vector<std::uint32_t>& inStrip) {
    if (inStrip.empty()) return;
    std::vector<BoxRay> rays;
    rays.reserve(std::size_t(y1 - y0) * width);
    for (int y = y0; y < y1; ++y)
      for (int x = 0; x < width; ++x) rays.push_back(rayOf(view.camera, x, y, width, height));
    for (const std::uint32_t n : inStrip) {
      const PixelRect& rect = rects[n];
      for (int y = std::max(y0, rect.y0); y < std::min(y1, rect.y1); ++y)
        for (int x = rect.x0; x < rect.x1; ++x) {
          const std::size_t i = std::size_t(y) * width + x;
          const BoxRay& ray = rays[std::size_t(y - y0) * width + x];
          const auto entry = enter(ray, boxes[n].box);
          if (entry && !(buffers.hit(i) && buffers.distance[i] <= static_cast<float>(entry->distance)))
            showCell(*boxes[n].cell, Shown::box, entry->distance, Vector3::Unit(entry->axis), ray.direction, i,
                     buffers);
        }
    }
    addValues(field, y0, rays, buffers);
  });
}

}  // namespace hpsdf::render
