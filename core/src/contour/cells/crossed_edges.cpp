#include "contour/cells/crossed_edges.h"

#include <algorithm>
#include <cmath>

#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

constexpr std::size_t kLeavesAtOnce = 256;
constexpr std::size_t kEdgesAtOnce = 512;

/// Returns the leaves around an edge, in the order of `CrossedEdge::cells`.
std::array<std::int32_t, 4> leavesAround(const ContourOctree& octree, const GridPoint& lower, int axis) {
  const int across = (axis + 1) % 3, up = (axis + 2) % 3;
  constexpr std::array<std::array<int, 2>, 4> kOffsets{{{-1, -1}, {0, -1}, {0, 0}, {-1, 0}}};
  std::array<std::int32_t, 4> leaves;
  for (std::size_t i = 0; i < 4; ++i) {
    GridPoint point = lower;
    point[across] += kOffsets[i][0];
    point[up] += kOffsets[i][1];
    leaves[i] = octree.leafAt(point);
  }
  return leaves;
}

/// Appends the crossed edges of a leaf of which no shorter part is an edge of a smaller leaf. Of equal leaves around an
/// edge, only the first one appends it. An edge that an older leaf shares is therefore not appended again.
void appendEdges(const ContourOctree& octree, std::int32_t leaf, const std::array<double, 8>& corners,
                 std::vector<CrossedEdge>& edges) {
  const ContourCell& cell = octree[leaf];
  for (int axis = 0; axis < 3; ++axis)
    for (int corner = 0; corner < 8; ++corner) {
      if (corner >> axis & 1) continue;
      const int upper = corner | 1 << axis;
      if (isInside(corners[corner]) == isInside(corners[upper])) continue;
      GridPoint lower = cell.lower;
      for (int k = 0; k < 3; ++k) lower[k] += (corner >> k & 1) * cell.size;
      const std::array<std::int32_t, 4> around = leavesAround(octree, lower, axis);
      const bool isOurs = std::ranges::all_of(around, [&](std::int32_t other) {
        if (other < 0 || other == leaf) return true;
        const std::int32_t size = octree[other].size;
        return size > cell.size || (size == cell.size && other > leaf);
      });
      if (!isOurs) continue;
      edges.push_back({lower,
                       axis,
                       cell.size,
                       isInside(corners[corner]),
                       around,
                       {corners[corner], corners[upper]},
                       Vector3::Zero(),
                       Vector3::Zero(),
                       {}});
    }
}

/// A bracket of the crossing of an edge, as fractions of its length, while the crossing is being sought.
struct Bracket {
  double low = 0, high = 1;
  double atLow, atHigh;  ///< values there, scaled by the Illinois method where an end stays
  double at = 0;         ///< where the function is evaluated next
  int side = 0;          ///< the end that moved last: −1 or 1

  /// Sets `at` to the crossing of the secant, kept away from both ends.
  void aim() {
    const double secant = (low * atHigh - high * atLow) / (atHigh - atLow);
    const double margin = 1e-3 * (high - low);
    at = std::clamp(secant, low + margin, high - margin);
  }

  void narrow(double value) {
    const bool movesLow = isInside(value) == isInside(atLow);
    (movesLow ? low : high) = at;
    (movesLow ? atLow : atHigh) = value;
    if (movesLow && side == -1) atHigh /= 2;
    if (!movesLow && side == 1) atLow /= 2;
    side = movesLow ? -1 : 1;
  }
};

/// Finds where the surface crosses at most kEdgesAtOnce edges, with the normals there.
void findPoints(const ImplicitSurface& surface, const ContourOctree& octree, std::span<CrossedEdge> edges,
                double accuracy) {
  constexpr int kMostSteps = 24;
  std::array<Bracket, kEdgesAtOnce> brackets;
  std::array<std::uint32_t, kEdgesAtOnce> open;
  std::array<Vector3, kEdgesAtOnce> points;
  std::array<double, kEdgesAtOnce> values;
  const auto pointAt = [&](std::size_t edge, double t) {
    const CrossedEdge& e = edges[edge];
    GridPoint upper = e.lower;
    upper[e.axis] += e.size;
    return Vector3((1 - t) * octree.position(e.lower) + t * octree.position(upper));
  };
  std::size_t count = edges.size();
  for (std::size_t i = 0; i < count; ++i) {
    brackets[i] = {.atLow = edges[i].values[0], .atHigh = edges[i].values[1]};
    open[i] = static_cast<std::uint32_t>(i);
  }
  for (int step = 0; step < kMostSteps && count > 0; ++step) {
    for (std::size_t i = 0; i < count; ++i) {
      brackets[open[i]].aim();
      points[i] = pointAt(open[i], brackets[open[i]].at);
    }
    surface.values(std::span(points).first(count), std::span(values).first(count));
    std::size_t left = 0;
    for (std::size_t i = 0; i < count; ++i) {
      Bracket& bracket = brackets[open[i]];
      bracket.narrow(values[i]);
      const double length = octree.smallestEdge() * edges[open[i]].size * (bracket.high - bracket.low);
      if (std::abs(values[i]) > accuracy && length > accuracy) open[left++] = open[i];
    }
    count = left;
  }
  std::array<ValueAndGradient, kEdgesAtOnce> found;
  for (std::size_t i = 0; i < edges.size(); ++i) points[i] = edges[i].point = pointAt(i, brackets[i].at);
  surface.valuesAndGradients(std::span(points).first(edges.size()), std::span(found).first(edges.size()));
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const double length = found[i].gradient.norm();
    edges[i].normal = length > 0 ? Vector3(found[i].gradient / length)
                                 : Vector3(Vector3::Unit(edges[i].axis) * (edges[i].lowerInside ? 1 : -1));
  }
}

/// Gives an edge the leaves that are around it now. Returns false if one of them is smaller than the edge is long.
bool keepsEdge(const ContourOctree& octree, CrossedEdge& edge) {
  const auto isDivided = [&](std::int32_t cell) { return cell >= 0 && !octree[cell].isLeaf(); };
  if (!std::ranges::any_of(edge.cells, isDivided)) return true;
  edge.cells = leavesAround(octree, edge.lower, edge.axis);
  edge.polygon.isChanged = true;
  return std::ranges::all_of(edge.cells, [&](std::int32_t cell) { return cell < 0 || octree[cell].size >= edge.size; });
}

}  // namespace

void updateCrossedEdges(const ImplicitSurface& surface, const ContourOctree& octree, std::size_t firstNew,
                        const std::vector<CellSamples>& samples, double accuracy, const Progress& progress,
                        std::vector<CrossedEdge>& edges) {
  std::erase_if(edges, [&](CrossedEdge& edge) { return !keepsEdge(octree, edge); });
  const auto added = detail::listOfChunks<CrossedEdge>(
      octree.cells().size() - firstNew, kLeavesAtOnce, Progress{.cancelled = progress.cancelled}, "",
      [&](std::vector<CrossedEdge>& found, std::size_t first, std::size_t count) {
        for (std::size_t i = firstNew + first; i < firstNew + first + count; ++i)
          if (octree.cells()[i].isLeaf() && samples[i].changesSign)
            appendEdges(octree, static_cast<std::int32_t>(i), samples[i].corners, found);
      });
  const std::size_t kept = edges.size();
  edges.insert(edges.end(), added.begin(), added.end());
  const std::span fresh = std::span(edges).subspan(kept);
  detail::forEachChunk(fresh.size(), kEdgesAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
    progress.throwIfCancelled();
    findPoints(surface, octree, fresh.subspan(first, count), accuracy);
  });
}

}  // namespace hpsdf::contouring
