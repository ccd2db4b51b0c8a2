#include "hpsdf/output/grids.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>

#include "arrays/npy.h"
#include "grids/grid_memory.h"
#include "hpsdf/detail/threads.h"
#include "util/chunks.h"

namespace hpsdf {
namespace {

constexpr std::size_t kPointsOfGridQuery = 4096;
constexpr int kMostVoxels = 1 << 30;  ///< along an axis; far more than memory can hold

/// Returns the position of the point with this number, counted with x fastest.
Vector3 gridPosition(const GridLayout& layout, std::size_t number) {
  const std::size_t row = layout.points[0], slab = row * layout.points[1];
  return layout.position(number % row, number % slab / row, number / slab);
}

/// Evaluates the field at `count` points from the point `first` on.
void samplePoints(const Field& field, std::size_t first, std::size_t count, RegularGrid& grid) {
  std::vector<Vector3> points(count);
  for (std::size_t n = 0; n < count; ++n) points[n] = gridPosition(grid.layout, first + n);
  if (grid.gradients.empty()) return field.values(points, std::span(grid.values).subspan(first, count));
  std::vector<ValueAndGradient> results(count);
  field.valuesAndGradients(points, results);
  for (std::size_t n = 0; n < count; ++n) {
    grid.values[first + n] = results[n].value;
    grid.gradients[first + n] = results[n].gradient;
  }
}

/// Writes the values and, if there are any, the gradients of a grid as one array of `Number`.
template <typename Number>
void writeNumbers(const RegularGrid& grid, OutputFile& out) {
  const bool hasGradients = !grid.gradients.empty();
  std::vector<std::size_t> shape(grid.layout.points.rbegin(), grid.layout.points.rend());
  if (hasGradients) shape.push_back(4);
  std::vector<Number> numbers;
  numbers.reserve(grid.values.size() * (hasGradients ? 4 : 1));
  for (std::size_t n = 0; n < grid.values.size(); ++n) {
    numbers.push_back(static_cast<Number>(grid.values[n]));
    if (hasGradients)
      for (int axis = 0; axis < 3; ++axis) numbers.push_back(static_cast<Number>(grid.gradients[n][axis]));
  }
  arrays::writeNpy(arrays::viewOf(std::span<const Number>(numbers), std::move(shape)),
                   [&](std::span<const std::byte> bytes) { out.write(bytes); });
}

}  // namespace

GridLayout gridOfCells(const Box& box, const std::array<std::uint32_t, 3>& cells) {
  GridLayout layout{.points = {}, .origin = box.min(), .spacing = box.sizes()};
  for (int axis = 0; axis < 3; ++axis) {
    layout.points[axis] = cells[axis] + 1;
    layout.spacing[axis] /= cells[axis];
  }
  return layout;
}

GridLayout gridOfVoxels(const Box& box, double voxel) {
  if (!(voxel > 0) || !std::isfinite(voxel))
    throw Error(ErrorKind::option, "voxel", "the size of a voxel must be a positive length");
  if (!(box.sizes().maxCoeff() / voxel < kMostVoxels))
    throw Error(ErrorKind::option, "voxel",
                "the box has more than " + std::to_string(kMostVoxels) + " voxels along an axis; give larger voxels");
  const Vector3 first = (box.min() / voxel).array().ceil(), last = (box.max() / voxel).array().floor();
  const Vector3 points = last - first + Vector3::Ones();
  if (!(points.minCoeff() >= 1))
    throw Error(ErrorKind::option, "voxel", "voxels of this size have no point in the domain; give a smaller size");
  grids::requireGridMemory(points.x(), points.y(), points.z(), sizeof(double));
  GridLayout layout{.points = {}, .origin = first * voxel + Vector3::Zero(), .spacing = Vector3::Constant(voxel)};
  for (int axis = 0; axis < 3; ++axis) layout.points[axis] = static_cast<std::uint32_t>(points[axis]);
  return layout;
}

RegularGrid sampleGrid(const Field& field, const GridLayout& layout, bool withGradients, int threads,
                       const Progress& progress) {
  const std::size_t bytes = sizeof(double) + (withGradients ? sizeof(Vector3) : 0);
  // The file's array is made beside the values.
  grids::requireGridMemory(layout.points[0], layout.points[1], layout.points[2], 2 * double(bytes));
  RegularGrid grid{.layout = layout, .values = std::vector<double>(layout.count()), .gradients = {}};
  if (withGradients) grid.gradients.resize(layout.count());
  withThreads(threads, [&] {
    const auto sample = [&](std::size_t, std::size_t first, std::size_t count) {
      samplePoints(field, first, count, grid);
    };
    detail::forEachChunk(grid.values.size(), kPointsOfGridQuery, progress, "sampling", sample);
  });
  return grid;
}

void writeNpy(const RegularGrid& grid, NumberType type, OutputFile& out, const Progress& progress) {
  progress.update("writing", 0);
  if (type == NumberType::float32)
    writeNumbers<float>(grid, out);
  else
    writeNumbers<double>(grid, out);
  out.flush();
}

}  // namespace hpsdf
