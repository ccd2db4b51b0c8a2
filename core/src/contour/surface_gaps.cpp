#include "contour/surface_gaps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "bvh/triangle_frame.h"
#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

constexpr std::size_t kGapLeavesAtOnce = 64;
constexpr std::size_t kSeedsOfLeaf = 9;  ///< the middles of a leaf and of its eight parts
constexpr std::size_t kGapPointsAtOnce = kSeedsOfLeaf * kGapLeavesAtOnce;

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

}  // namespace

void findSurfaceGaps(const ImplicitSurface& surface, const ContourOctree& octree, std::span<const CrossedEdge> edges,
                     const Sheets& sheets, const DualMesh& mesh, double accuracy, const Progress& progress,
                     std::vector<double>& gaps) {
  const std::vector<LeafSheets> leaves = leavesOf(sheets, gaps);
  const TrianglesOfEdges trianglesOfEdges(edges.size(), mesh.edgeOfTriangle);
  detail::forEachChunk(leaves.size(), kGapLeavesAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
    progress.throwIfCancelled();
    std::array<Vector3, kGapPointsAtOnce> memory;
    std::array<bool, kGapPointsAtOnce> counts;
    const std::span points = std::span(memory).first(kSeedsOfLeaf * count);
    const auto boxOf = [&](std::size_t i) { return octree.box(octree[leaves[first + i].cell]); };
    for (std::size_t i = 0; i < count; ++i) {
      const Box box = boxOf(i);
      for (int n = 0; n < 8; ++n)
        points[kSeedsOfLeaf * i + n] = (box.center() + box.corner(static_cast<Box::CornerType>(n))) / 2;
      points[kSeedsOfLeaf * i + 8] = box.center();
    }
    moveToSurface(surface, points, accuracy, counts);
    for (std::size_t i = 0; i < count; ++i) {
      const Box box = boxOf(i);
      const std::span ours = points.subspan(kSeedsOfLeaf * i, kSeedsOfLeaf);
      const std::span isOurs = std::span(counts).subspan(kSeedsOfLeaf * i, kSeedsOfLeaf);
      for (std::size_t k = 0; k < kSeedsOfLeaf; ++k) isOurs[k] = isOurs[k] && box.contains(ours[k]);
      gaps[static_cast<std::size_t>(leaves[first + i].cell)] =
          greatestGapOf(leaves[first + i], sheets, trianglesOfEdges, mesh, ours, isOurs);
    }
  });
}

}  // namespace hpsdf::contouring
