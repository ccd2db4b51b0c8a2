#include "contour/cell_samples.h"

#include <algorithm>

#include "contour/meeting_point.h"
#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

constexpr int kLattice = 3;  ///< points along each axis
constexpr std::size_t kPoints = kLattice * kLattice * kLattice;
constexpr std::size_t kCellsAtOnce = 64;

using Lattice = std::array<double, kPoints>;

constexpr int latticeIndex(int x, int y, int z) { return (z * kLattice + y) * kLattice + x; }

/// Returns true if the middle one of three points in a row along an axis differs in sign from both others.
bool hidesSheet(const Lattice& values) {
  constexpr std::array<int, 3> kStride{1, kLattice, kLattice * kLattice};
  for (int axis = 0; axis < 3; ++axis)
    for (int v = 0; v < kLattice; ++v)
      for (int u = 0; u < kLattice; ++u) {
        const int first = u * kStride[(axis + 1) % 3] + v * kStride[(axis + 2) % 3];
        const bool before = isInside(values[first]), middle = isInside(values[first + kStride[axis]]),
                   after = isInside(values[first + 2 * kStride[axis]]);
        if (before == after && middle != before) return true;
      }
  return false;
}

CellSamples samplesOf(const Lattice& values) {
  CellSamples samples{.mayHoldSurface = true};
  int inside = 0;
  for (int n = 0; n < 8; ++n) {
    samples.corners[n] = values[latticeIndex((n & 1) * 2, (n >> 1 & 1) * 2, (n >> 2 & 1) * 2)];
    inside += isInside(samples.corners[n]);
  }
  samples.changesSign = inside > 0 && inside < 8;
  samples.hides = hidesSheet(values);
  return samples;
}

/// Sets the misfits of cells, at most kCellsAtOnce.
void findMisfits(const ImplicitSurface& surface, const ContourOctree& octree, std::span<const std::int32_t> cells,
                 std::span<CellSamples> samples) {
  constexpr std::size_t kEdges = 12;
  std::array<Vector3, kCellsAtOnce * kEdges> points;
  std::array<ValueAndGradient, kCellsAtOnce * kEdges> found;
  std::array<std::size_t, kCellsAtOnce + 1> first{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Box box = octree.box(octree[cells[i]]);
    const std::array<double, 8>& corners = samples[i].corners;
    for (int axis = 0; axis < 3 && samples[i].changesSign; ++axis)
      for (int lower = 0; lower < 8; ++lower) {
        const int upper = lower | 1 << axis;
        if (upper == lower || isInside(corners[lower]) == isInside(corners[upper])) continue;
        const double t = corners[lower] / (corners[lower] - corners[upper]);
        points[count] = box.corner(static_cast<Box::CornerType>(lower));
        points[count++][axis] += t * box.sizes()[axis];
      }
    first[i + 1] = count;
  }
  surface.valuesAndGradients(std::span(points).first(count), std::span(found).first(count));
  std::vector<TangentPlane> planes;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    planes.clear();
    for (std::size_t n = first[i]; n < first[i + 1]; ++n)
      if (const double length = found[n].gradient.norm(); length > 0) {
        // The point is near the surface only; one step along the gradient leads to it.
        const Vector3 normal = found[n].gradient / length;
        planes.push_back({points[n] - normal * (found[n].value / length), normal});
      }
    if (!planes.empty()) samples[i].misfit = greatestDistance(meetingPointOf(planes), planes);
  }
}

/// Samples at most kCellsAtOnce cells. Cells of which the range excludes 0 are not sampled.
void sampleChunk(const ImplicitSurface& surface, const ContourOctree& octree, std::span<const std::int32_t> cells,
                 double thin, std::span<CellSamples> out) {
  std::array<Vector3, kCellsAtOnce * kPoints> points;
  std::array<double, kCellsAtOnce * kPoints> values;
  std::array<Interval, kCellsAtOnce> ranges;
  std::array<std::size_t, kCellsAtOnce> sampled;
  std::size_t count = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const ContourCell& cell = octree[cells[i]];
    // The box is a little greater than the cell, because values at its faces may be those of neighbours.
    Box box = octree.box(cell);
    const Vector3 margin = 1e-9 * box.sizes();
    box = Box(Vector3(box.min() - margin), Vector3(box.max() + margin));
    ranges[count] = surface.range(box);
    out[i] = {};
    if (ranges[count].min > 0 || ranges[count].max < 0) continue;
    sampled[count] = i;
    for (int z = 0; z < kLattice; ++z)
      for (int y = 0; y < kLattice; ++y)
        for (int x = 0; x < kLattice; ++x) {
          const std::int32_t half = cell.size / 2;
          points[count * kPoints + latticeIndex(x, y, z)] =
              octree.position({cell.lower[0] + x * half, cell.lower[1] + y * half, cell.lower[2] + z * half});
        }
    ++count;
  }
  surface.values(std::span(points).first(count * kPoints), std::span(values).first(count * kPoints));
  for (std::size_t n = 0; n < count; ++n) {
    Lattice lattice;
    std::copy_n(&values[n * kPoints], kPoints, lattice.begin());
    CellSamples& samples = out[sampled[n]] = samplesOf(lattice);
    if (!samples.changesSign) samples.hides |= ranges[n].min < -thin && ranges[n].max > thin;
  }
  findMisfits(surface, octree, cells, out);
}

}  // namespace

void sampleCells(const ImplicitSurface& surface, const ContourOctree& octree, std::span<const std::int32_t> cells,
                 double thin, const Progress& progress, std::vector<CellSamples>& samples) {
  samples.resize(octree.cells().size());
  detail::forEachChunk(cells.size(), kCellsAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
    progress.throwIfCancelled();
    std::array<CellSamples, kCellsAtOnce> found;
    sampleChunk(surface, octree, cells.subspan(first, count), thin, std::span(found).first(count));
    for (std::size_t i = 0; i < count; ++i) samples[static_cast<std::size_t>(cells[first + i])] = found[i];
  });
}

}  // namespace hpsdf::contouring
