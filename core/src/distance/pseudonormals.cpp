#include "distance/pseudonormals.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>
#include <utility>

namespace hpsdf::distance {
namespace {

/// The corners of all triangles by their vertex, as numbers 3·slot + k: those of v are [first[v], first[v + 1]).
struct CornersByVertex {
  std::vector<std::uint32_t> first;
  std::vector<std::uint32_t> corners;
};

CornersByVertex groupCorners(const Hierarchy& hierarchy) {
  const auto triangles = hierarchy.triangles();
  CornersByVertex grouped{std::vector<std::uint32_t>(hierarchy.vertices().size() + 1, 0),
                          std::vector<std::uint32_t>(3 * triangles.size())};
  for (const auto& triangle : triangles)
    for (const std::uint32_t v : triangle) ++grouped.first[v];
  for (std::size_t v = 1; v < grouped.first.size(); ++v) grouped.first[v] += grouped.first[v - 1];
  // backwards, so that each group ends up ascending and `first` at its beginning
  for (std::size_t slot = triangles.size(); slot-- > 0;)
    for (std::uint32_t k = 3; k-- > 0;)
      grouped.corners[--grouped.first[triangles[slot][k]]] = static_cast<std::uint32_t>(3 * slot + k);
  return grouped;
}

Vector3 unitNormal(const TriangleFrame& frame) { return hasArea(frame) ? frame.normal : Vector3(Vector3::Zero()); }

/// What happens at one vertex after another; keeps its memory from one to the next.
class AtVertex {
 public:
  explicit AtVertex(const Hierarchy& hierarchy) : hierarchy_(hierarchy) {}

  /// Comes to a vertex, where all these corners are.
  void visit(std::span<const std::uint32_t> corners) {
    corners_.clear();
    for (const std::uint32_t corner : corners) corners_.emplace_back(triangleOf(corner), corner);
    std::sort(corners_.begin(), corners_.end());  // sums in the order of the mesh do not depend on the hierarchy
  }

  Vector3 sum() const {
    Vector3 total = Vector3::Zero();
    for (const auto& [triangle, corner] : corners_) {
      const Vector3& at = vertex(corner / 3, corner % 3);
      const Vector3 next = vertex(corner / 3, (corner + 1) % 3) - at;
      const Vector3 previous = vertex(corner / 3, (corner + 2) % 3) - at;
      const double angle = std::atan2(next.cross(previous).norm(), next.dot(previous));
      total += angle * unitNormal(hierarchy_.frames()[corner / 3]);
    }
    return total;
  }

  /// Links those sides of the triangles here whose other end is no lower vertex than this one, `self`, edge by edge.
  void link(std::uint32_t self, std::vector<std::uint32_t>& nextSide) {
    sides_.clear();
    for (const auto& [triangle, corner] : corners_) {
      const std::uint32_t slot = corner / 3, k = corner % 3;
      const std::uint32_t next = hierarchy_.triangles()[slot][(k + 1) % 3];
      const std::uint32_t previous = hierarchy_.triangles()[slot][(k + 2) % 3];
      if (next >= self) sides_.push_back({next, triangle, corner});
      if (previous > self) sides_.push_back({previous, triangle, 3 * slot + (k + 2) % 3});
    }
    std::sort(sides_.begin(), sides_.end());
    for (std::size_t begin = 0, end = 0; begin < sides_.size(); begin = end) {
      while (end < sides_.size() && sides_[end].other == sides_[begin].other) ++end;
      for (std::size_t i = begin; i < end; ++i) nextSide[sides_[i].number] = sides_[i + 1 < end ? i + 1 : begin].number;
    }
  }

 private:
  struct Side {
    std::uint32_t other, triangle, number;
    auto operator<=>(const Side&) const = default;
  };

  std::uint32_t triangleOf(std::uint32_t corner) const { return hierarchy_.frames()[corner / 3].triangle; }
  const Vector3& vertex(std::uint32_t slot, std::uint32_t k) const {
    return hierarchy_.vertices()[hierarchy_.triangles()[slot][k]];
  }

  const Hierarchy& hierarchy_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> corners_;  ///< triangle in the mesh, number
  std::vector<Side> sides_;
};

}  // namespace

Pseudonormals::Pseudonormals(const Hierarchy& hierarchy)
    : vertices_(hierarchy.vertices().size()), nextSide_(3 * hierarchy.triangles().size()) {
  const CornersByVertex grouped = groupCorners(hierarchy);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, vertices_.size()), [&](const auto& range) {
    AtVertex at(hierarchy);
    for (std::size_t v = range.begin(); v < range.end(); ++v) {
      at.visit(std::span(grouped.corners).subspan(grouped.first[v], grouped.first[v + 1] - grouped.first[v]));
      vertices_[v] = at.sum();
      at.link(static_cast<std::uint32_t>(v), nextSide_);
    }
  });
}

Vector3 Pseudonormals::ofEdge(const Hierarchy& hierarchy, std::uint32_t slot, std::uint32_t k) const {
  const auto rank = [&](std::uint32_t side) { return std::pair(hierarchy.frames()[side / 3].triangle, side); };
  std::uint32_t side = 3 * slot + k;
  while (rank(nextSide_[side]) > rank(side)) side = nextSide_[side];
  const std::uint32_t last = side;
  Vector3 sum = Vector3::Zero();
  do {
    side = nextSide_[side];
    sum += unitNormal(hierarchy.frames()[side / 3]);
  } while (side != last);
  return sum;
}

std::size_t Pseudonormals::bytes() const {
  return vertices_.size() * sizeof(vertices_[0]) + nextSide_.size() * sizeof(nextSide_[0]);
}

}  // namespace hpsdf::distance
