#include "contour/cells/cell_samples.h"

#include <algorithm>
#include <cmath>

#include "contour/cells/meeting_point.h"
#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

constexpr int kLattice = 3;  ///< points along each axis
constexpr std::size_t kPoints = kLattice * kLattice * kLattice;
constexpr std::size_t kCellsAtOnce = 64;

using Lattice = std::array<double, kPoints>;

constexpr int latticeIndex(int x, int y, int z) { return (z * kLattice + y) * kLattice + x; }

/// Returns true if the middle one of three points in a row along an axis differs in sign from both others, and its
/// value is above `bulge` in magnitude.
bool hidesSheet(const Lattice& values, double bulge) {
  constexpr std::array<int, 3> kStride{1, kLattice, kLattice * kLattice};
  for (int axis = 0; axis < 3; ++axis)
    for (int v = 0; v < kLattice; ++v)
      for (int u = 0; u < kLattice; ++u) {
        const int first = u * kStride[(axis + 1) % 3] + v * kStride[(axis + 2) % 3];
        const bool before = isInside(values[first]), middle = isInside(values[first + kStride[axis]]),
                   after = isInside(values[first + 2 * kStride[axis]]);
        if (before == after && middle != before && std::abs(values[first + kStride[axis]]) > bulge) return true;
      }
  return false;
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
    if (!planes.empty()) samples[i].misfit = greatestDistance(meetingPointOf(planes, middleOf(planes)), planes);
  }
}

/// Sets the values at the corners of cells, at most kCellsAtOnce.
void sampleCorners(const ImplicitSurface& surface, const ContourOctree& octree, std::span<const std::int32_t> cells,
                   std::span<CellSamples> out) {
  std::array<Vector3, kCellsAtOnce * 8> points;
  std::array<double, kCellsAtOnce * 8> values;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Box box = octree.box(octree[cells[i]]);
    for (int n = 0; n < 8; ++n) points[8 * i + n] = box.corner(static_cast<Box::CornerType>(n));
  }
  surface.values(std::span(points).first(8 * cells.size()), std::span(values).first(8 * cells.size()));
  for (std::size_t i = 0; i < cells.size(); ++i) {
    out[i] = {};
    std::copy_n(&values[8 * i], 8, out[i].corners.begin());
    const auto inside = std::ranges::count_if(out[i].corners, isInside);
    out[i].changesSign = inside > 0 && inside < 8;
  }
}

/// Calls visit(numbers along the axes, whether it is a corner) for each point of a lattice.
template <typename Visit>
void forEachLatticePoint(const Visit& visit) {
  for (int z = 0; z < kLattice; ++z)
    for (int y = 0; y < kLattice; ++y)
      for (int x = 0; x < kLattice; ++x) visit(std::array{x, y, z}, x != 1 && y != 1 && z != 1);
}

bool mayHoldSurface(const CellSamples& cell) { return cell.changesSign || cell.mayHide; }

/// Finds out which of the cells that the surface may pass through hide a sheet.
void findHiddenSheets(const ImplicitSurface& surface, const ContourOctree& octree, std::span<const std::int32_t> cells,
                      double bulge, std::span<CellSamples> samples) {
  std::array<Vector3, kCellsAtOnce * kPoints> points;
  std::array<double, kCellsAtOnce * kPoints> values;
  std::size_t count = 0;
  // Corners of the cell are known, all other points of the lattice are evaluated.
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (!mayHoldSurface(samples[i])) continue;
    const auto& [lower, size, child] = octree[cells[i]];
    forEachLatticePoint([&, lower = lower, half = size / 2](const std::array<int, 3>& at, bool isCorner) {
      if (!isCorner)
        points[count++] = octree.position({lower[0] + at[0] * half, lower[1] + at[1] * half, lower[2] + at[2] * half});
    });
  }
  surface.values(std::span(points).first(count), std::span(values).first(count));
  count = 0;
  for (CellSamples& cell : samples) {
    if (!mayHoldSurface(cell)) continue;
    Lattice lattice;
    forEachLatticePoint([&](const std::array<int, 3>& at, bool isCorner) {
      lattice[latticeIndex(at[0], at[1], at[2])] =
          isCorner ? cell.corners[at[0] / 2 + at[1] / 2 * 2 + at[2] / 2 * 4] : values[count++];
    });
    cell.hides = hidesSheet(lattice, cell.changesSign ? bulge : 0);
  }
}

/// Samples at most kCellsAtOnce cells.
void sampleChunk(const ImplicitSurface& surface, const ContourOctree& octree, std::span<const std::int32_t> cells,
                 double bulge, std::span<CellSamples> out) {
  sampleCorners(surface, octree, cells, out);
  for (std::size_t i = 0; i < cells.size(); ++i)
    if (!out[i].changesSign)
      out[i].mayHide = surface.mayChangeSign(octree.box(octree[cells[i]]), isInside(out[i].corners[0]));
  findHiddenSheets(surface, octree, cells, bulge, out);
  findMisfits(surface, octree, cells, out);
}

}  // namespace

void sampleCells(const ImplicitSurface& surface, const ContourOctree& octree, std::span<const std::int32_t> cells,
                 double bulge, const Progress& progress, std::vector<CellSamples>& samples) {
  samples.resize(octree.cells().size());
  detail::forEachChunk(cells.size(), kCellsAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
    progress.throwIfCancelled();
    std::array<CellSamples, kCellsAtOnce> found;
    sampleChunk(surface, octree, cells.subspan(first, count), bulge, std::span(found).first(count));
    for (std::size_t i = 0; i < count; ++i) samples[static_cast<std::size_t>(cells[first + i])] = found[i];
  });
}

}  // namespace hpsdf::contouring
