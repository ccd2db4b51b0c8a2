#include "contour/surface_gaps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "bvh/triangle_frame.h"
#include "contour/cells/projection.h"
#include "util/chunks.h"
#include "util/grouping.h"

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

/// Returns the greatest distance from points to the nearest of some triangles, which are given by their frames'
/// numbers.
double greatestDistanceOf(std::span<const Vector3> points, std::span<const std::uint32_t> triangles,
                          std::span<const bvh::TriangleFrame> frames) {
  const auto frameOf = [&](std::size_t i) -> const bvh::TriangleFrame& { return frames[triangles[i]]; };
  double greatest = 0;
  for (const Vector3& point : points)
    greatest = std::max(greatest, bvh::leastSquaredDistance(triangles.size(), frameOf, point, greatest));
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
        trianglesOfEdges_(edges,
                          [&](const auto& visit) {
                            for (std::uint32_t n = 0; n < mesh.triangles.size(); ++n) visit(mesh.edgeOfTriangle[n], n);
                          }),
        frames_(mesh.triangles.size()),
        accuracy_(accuracy),
        progress_(progress) {
    constexpr std::size_t kAtOnce = 1024;
    detail::forEachChunk(frames_.size(), kAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
      for (std::size_t n = first; n < first + count; ++n) {
        const Triangle& t = mesh.triangles[n];
        frames_[n] = bvh::makeFrame({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]},
                                    static_cast<std::uint32_t>(n));
      }
    });
  }

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
    std::array<double, kGapPointsAtOnce> magnitudes;
    const std::span points = std::span(memory).first(seeds.size() * leaves.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Box box = octree_.box(octree_[leaves[i / seeds.size()].cell]);
      points[i] = box.min() + seeds[i % seeds.size()].cwiseProduct(box.sizes());
    }
    projectOntoSurface(surface_, accuracy_, points, std::span(magnitudes).first(points.size()));
    std::vector<Vector3> found;
    for (std::size_t i = 0; i < leaves.size(); ++i) {
      const Box box = octree_.box(octree_[leaves[i].cell]);
      found.clear();
      for (std::size_t k = seeds.size() * i; k < seeds.size() * (i + 1); ++k)
        if (magnitudes[k] <= accuracy_ && box.contains(points[k])) found.push_back(points[k]);
      double& gap = gaps[static_cast<std::size_t>(leaves[i].cell)];
      gap = std::max(gap, greatestDistanceOf(found, trianglesAround(leaves[i]), frames_));
    }
  }

  /// Returns the triangles around the crossed edges of a leaf.
  std::vector<std::uint32_t> trianglesAround(const LeafSheets& leaf) const {
    std::vector<std::uint32_t> triangles;
    for (std::uint32_t sheet = leaf.first; sheet < leaf.end; ++sheet)
      for (const std::uint32_t edge : sheets_.edgesOf(sheet)) {
        const std::span more = trianglesOfEdges_[edge];
        triangles.insert(triangles.end(), more.begin(), more.end());
      }
    return triangles;
  }

  const ImplicitSurface& surface_;
  const ContourOctree& octree_;
  const Sheets& sheets_;
  detail::Grouping trianglesOfEdges_;
  std::vector<bvh::TriangleFrame> frames_;  ///< by triangle
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
