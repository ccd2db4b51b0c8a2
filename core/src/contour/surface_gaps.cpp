#include "contour/surface_gaps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "bvh/triangle_frame.h"
#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

constexpr std::size_t kGapPointsAtOnce = 576;

/// A search for the greatest gap in a leaf from a lattice of starting points. The gap of a few points suffices in most
/// leaves; where it is not far below the tolerance, more points are searched.
struct GapStage {
  int along;     ///< starting points along each axis
  double above;  ///< the least gap known of a leaf, in tolerances, with which this search is made in it
};
constexpr std::array<GapStage, 3> kGapStages{{{2, -std::numeric_limits<double>::infinity()}, {4, 0.4}, {8, 0.75}}};

/// Returns the starting points of a search in the unit cube: the middles of its parts, and its own if these are few.
std::vector<Vector3> seedsOf(const GapStage& stage) {
  std::vector<Vector3> seeds;
  const int k = stage.along;
  for (int n = 0; n < k * k * k; ++n)
    seeds.push_back((Vector3(n % k, n / k % k, n / (k * k)) + 0.5 * Vector3::Ones()) / k);
  if (k == 2) seeds.push_back(Vector3::Constant(0.5));
  return seeds;
}

/// A leaf with its sheets, which are successive.
struct LeafSheets {
  std::int32_t cell;
  std::uint32_t first, end;
};

/// Returns the leaves with sheets of which the gap is not known.
std::vector<LeafSheets> leavesOf(const Sheets& sheets, const std::vector<double>& gaps) {
  std::vector<LeafSheets> leaves;
  for (std::uint32_t sheet = 0; sheet < sheets.size(); ++sheet) {
    if (gaps[static_cast<std::size_t>(sheets.cellOf(sheet))] >= 0) continue;
    if (leaves.empty() || leaves.back().cell != sheets.cellOf(sheet))
      leaves.push_back({sheets.cellOf(sheet), sheet, sheet});
    ++leaves.back().end;
  }
  return leaves;
}

/// The triangles of each crossed edge's polygon.
class TrianglesOfEdges {
 public:
  TrianglesOfEdges(std::size_t edges, std::span<const std::uint32_t> edgeOfTriangle)
      : first_(edges + 1), triangles_(edgeOfTriangle.size()) {
    for (const std::uint32_t edge : edgeOfTriangle) ++first_[edge + 1];
    for (std::size_t edge = 0; edge < edges; ++edge) first_[edge + 1] += first_[edge];
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t n = 0; n < edgeOfTriangle.size(); ++n) triangles_[next[edgeOfTriangle[n]]++] = n;
  }

  std::span<const std::uint32_t> of(std::uint32_t edge) const {
    return std::span(triangles_).subspan(first_[edge], first_[edge + 1] - first_[edge]);
  }

 private:
  std::vector<std::uint32_t> first_, triangles_;
};

/// Moves points along the gradient to the zero set. Afterwards, a point counts if its value is at most `accuracy`.
void moveToSurface(const ImplicitSurface& surface, std::span<Vector3> points, double accuracy, std::span<bool> counts) {
  constexpr int kSteps = 4;
  std::array<ValueAndGradient, kGapPointsAtOnce> found;
  for (int step = 0; step <= kSteps; ++step) {
    surface.valuesAndGradients(points, std::span(found).first(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto& [value, gradient] = found[i];
      counts[i] = std::abs(value) <= accuracy;
      const double squared = gradient.squaredNorm();
      if (!counts[i] && step < kSteps && squared > 0.01) points[i] -= gradient * (value / squared);
    }
  }
}

/// Returns the greatest distance from those points that count to the triangles around the crossed edges of a leaf.
double greatestGapOf(const LeafSheets& leaf, const Sheets& sheets, const TrianglesOfEdges& trianglesOfEdges,
                     const DualMesh& mesh, std::span<const Vector3> points, std::span<const bool> counts) {
  std::vector<bvh::TriangleFrame> frames;
  for (std::uint32_t sheet = leaf.first; sheet < leaf.end; ++sheet)
    for (const std::uint32_t edge : sheets.edgesOf(sheet))
      for (const std::uint32_t n : trianglesOfEdges.of(edge)) {
        const Triangle& t = mesh.triangles[n];
        frames.push_back(bvh::makeFrame({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]}, n));
      }
  double greatest = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!counts[i]) continue;
    double least = std::numeric_limits<double>::infinity();
    for (const bvh::TriangleFrame& frame : frames) least = std::min(least, bvh::squaredDistance(frame, points[i]));
    greatest = std::max(greatest, least);
  }
  return std::sqrt(greatest);
}

/// Searches leaves for points of the surface.
class GapSearch {
 public:
  GapSearch(const ImplicitSurface& surface, const ContourOctree& octree, const Sheets& sheets, const DualMesh& mesh,
            std::size_t edges, double accuracy, const Progress& progress)
      : surface_(surface),
        octree_(octree),
        sheets_(sheets),
        mesh_(mesh),
        trianglesOfEdges_(edges, mesh.edgeOfTriangle),
        accuracy_(accuracy),
        progress_(progress) {}

  /// Raises the gaps of leaves to the greatest distances of the points that are found from these starting points.
  void search(std::span<const LeafSheets> leaves, std::span<const Vector3> seeds, std::vector<double>& gaps) const {
    const std::size_t leavesAtOnce = kGapPointsAtOnce / seeds.size();
    detail::forEachChunk(leaves.size(), leavesAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
      progress_.throwIfCancelled();
      searchSome(leaves.subspan(first, count), seeds, gaps);
    });
  }

 private:
  void searchSome(std::span<const LeafSheets> leaves, std::span<const Vector3> seeds, std::vector<double>& gaps) const {
    std::array<Vector3, kGapPointsAtOnce> memory;
    std::array<bool, kGapPointsAtOnce> counts;
    const std::span points = std::span(memory).first(seeds.size() * leaves.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Box box = octree_.box(octree_[leaves[i / seeds.size()].cell]);
      points[i] = box.min() + seeds[i % seeds.size()].cwiseProduct(box.sizes());
    }
    moveToSurface(surface_, points, accuracy_, counts);
    for (std::size_t i = 0; i < leaves.size(); ++i) {
      const Box box = octree_.box(octree_[leaves[i].cell]);
      const std::span ours = points.subspan(seeds.size() * i, seeds.size());
      const std::span isOurs = std::span(counts).subspan(seeds.size() * i, seeds.size());
      for (std::size_t k = 0; k < ours.size(); ++k) isOurs[k] = isOurs[k] && box.contains(ours[k]);
      double& gap = gaps[static_cast<std::size_t>(leaves[i].cell)];
      gap = std::max(gap, greatestGapOf(leaves[i], sheets_, trianglesOfEdges_, mesh_, ours, isOurs));
    }
  }

  const ImplicitSurface& surface_;
  const ContourOctree& octree_;
  const Sheets& sheets_;
  const DualMesh& mesh_;
  TrianglesOfEdges trianglesOfEdges_;
  double accuracy_;
  const Progress& progress_;
};

}  // namespace

void findSurfaceGaps(const ImplicitSurface& surface, const ContourOctree& octree, std::span<const CrossedEdge> edges,
                     const Sheets& sheets, const DualMesh& mesh, const GapLimits& limits, const Progress& progress,
                     std::vector<double>& gaps) {
  const GapSearch search(surface, octree, sheets, mesh, edges.size(), limits.accuracy, progress);
  std::vector<LeafSheets> leaves = leavesOf(sheets, gaps);
  for (const GapStage& stage : kGapStages) {
    std::erase_if(leaves, [&](const LeafSheets& leaf) {
      const double gap = gaps[static_cast<std::size_t>(leaf.cell)];
      return gap > limits.tolerance || gap < stage.above * limits.tolerance;
    });
    search.search(leaves, seedsOf(stage), gaps);
  }
}

}  // namespace hpsdf::contouring
