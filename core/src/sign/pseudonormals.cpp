#include "sign/pseudonormals.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace hpsdf::sign {
namespace {

/// Least length that the pseudonormal of an edge or vertex must have to decide a sign. At a sharp edge, the length is
/// about the angle between the edge's two faces. Near the edge, a dot product of half this angle's square decides the
/// sign. This dot product must be far above rounding errors.
constexpr double kSharp = 1e-6;

/// The corners of all triangles, grouped by vertex. Corner k of triangle s, in the hierarchy's order of triangles, has
/// the number 3·s + k. The corners of vertex v are at [first[v], first[v + 1]), in the order of the mesh's triangles.
struct CornersByVertex {
  std::vector<std::uint32_t> first;
  std::vector<std::uint32_t> corners;
};

CornersByVertex groupCorners(const bvh::Hierarchy& hierarchy) {
  const auto triangles = hierarchy.triangles();
  std::vector<std::uint32_t> slots(triangles.size());  // position of each mesh triangle in the hierarchy's order
  tbb::parallel_for(std::size_t{0}, slots.size(),
                    [&](std::size_t slot) { slots[hierarchy.numbers()[slot]] = static_cast<std::uint32_t>(slot); });
  CornersByVertex grouped{std::vector<std::uint32_t>(hierarchy.vertices().size() + 1, 0),
                          std::vector<std::uint32_t>(3 * triangles.size())};
  for (const auto& triangle : triangles)
    for (const std::uint32_t v : triangle) ++grouped.first[v];
  for (std::size_t v = 1; v < grouped.first.size(); ++v) grouped.first[v] += grouped.first[v - 1];
  // Fill each vertex's group of corners from its end. Afterwards first[v] is the beginning of the group of
  // vertex v.
  for (std::size_t t = slots.size(); t-- > 0;)
    for (std::uint32_t k = 3; k-- > 0;) grouped.corners[--grouped.first[triangles[slots[t]][k]]] = 3 * slots[t] + k;
  return grouped;
}

Vector3 unitNormal(const bvh::Hierarchy& hierarchy, std::uint32_t slot) {
  return bvh::unitNormalOf(hierarchy.corners(slot));
}

/// Returns the unit normals of all triangles in the hierarchy's order.
std::vector<Vector3> unitNormalsOf(const bvh::Hierarchy& hierarchy) {
  std::vector<Vector3> normals(hierarchy.triangles().size());
  tbb::parallel_for(std::size_t{0}, normals.size(),
                    [&](std::size_t slot) { normals[slot] = unitNormal(hierarchy, static_cast<std::uint32_t>(slot)); });
  return normals;
}

/// Computes the pseudonormals of vertices, one vertex after another, and reuses its buffers from vertex to
/// vertex.
class VertexVisitor {
 public:
  VertexVisitor(const bvh::Hierarchy& hierarchy, std::span<const Vector3> unitNormals,
                std::span<std::uint32_t> nextSide)
      : unitNormals_(unitNormals),
        triangles_(hierarchy.triangles()),
        vertices_(hierarchy.vertices()),
        nextSide_(nextSide) {}

  /// Returns the pseudonormal of a vertex, computed from all `corners` at the vertex. Also links the triangle sides at
  /// each edge from this vertex to a vertex whose index is not lower.
  Vector3 visit(std::uint32_t vertex, std::span<const std::uint32_t> corners) {
    sides_.clear();
    numbers_.clear();
    Vector3 sum = Vector3::Zero();
    for (const std::uint32_t corner : corners) {
      const std::uint32_t slot = corner / 3, k = corner % 3, before = (k + 2) % 3;
      const std::uint32_t next = triangles_[slot][(k + 1) % 3], previous = triangles_[slot][before];
      const Vector3 toNext = vertices_[next] - vertices_[vertex];
      const Vector3 toPrevious = vertices_[previous] - vertices_[vertex];
      sum += std::atan2(toNext.cross(toPrevious).norm(), toNext.dot(toPrevious)) * unitNormals_[slot];
      if (next >= vertex) addSide(next, corner);
      if (previous > vertex) addSide(previous, 3 * slot + before);
    }
    linkSides();
    return sum;
  }

 private:
  void addSide(std::uint32_t otherVertex, std::uint32_t number) {
    sides_.push_back(std::uint64_t{otherVertex} << 32 | numbers_.size());
    numbers_.push_back(number);
  }

  void linkSides() {
    std::sort(sides_.begin(), sides_.end());
    std::size_t first = 0;  // index of the first side at the current edge
    for (std::size_t i = 0; i < sides_.size(); ++i) {
      const bool last = i + 1 == sides_.size() || sides_[i + 1] >> 32 != sides_[i] >> 32;
      nextSide_[numberOf(sides_[i])] = numberOf(sides_[last ? first : i + 1]);
      if (last) first = i + 1;
    }
  }
  std::uint32_t numberOf(std::uint64_t side) const { return numbers_[static_cast<std::uint32_t>(side)]; }

  std::span<const Vector3> unitNormals_;  ///< by slot
  std::span<const Triangle> triangles_;
  std::span<const Vector3> vertices_;
  std::span<std::uint32_t> nextSide_;
  /// Sort keys that group the triangle sides at the current vertex by edge. The high half of a key is the other vertex
  /// of the side, the low half is the side's index in `numbers_`.
  std::vector<std::uint64_t> sides_;
  std::vector<std::uint32_t> numbers_;  ///< numbers 3·slot + k of the sides at the current vertex
};

}  // namespace

Pseudonormals::Pseudonormals(const bvh::Hierarchy& hierarchy)
    : vertices_(hierarchy.vertices().size()), nextSide_(3 * hierarchy.triangles().size()) {
  const CornersByVertex grouped = groupCorners(hierarchy);
  const std::vector<Vector3> unitNormals = unitNormalsOf(hierarchy);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, vertices_.size()), [&](const auto& range) {
    VertexVisitor visitor(hierarchy, unitNormals, nextSide_);
    for (std::size_t v = range.begin(); v < range.end(); ++v)
      vertices_[v] =
          visitor.visit(static_cast<std::uint32_t>(v),
                        std::span(grouped.corners).subspan(grouped.first[v], grouped.first[v + 1] - grouped.first[v]));
  });
}

Vector3 Pseudonormals::ofEdge(const bvh::Hierarchy& hierarchy, std::uint32_t slot, std::uint32_t k) const {
  const auto rank = [&](std::uint32_t side) { return std::pair(hierarchy.numbers()[side / 3], side); };
  std::uint32_t side = 3 * slot + k;
  while (rank(nextSide_[side]) > rank(side)) side = nextSide_[side];
  const std::uint32_t last = side;
  Vector3 sum = Vector3::Zero();
  do {
    side = nextSide_[side];
    sum += unitNormal(hierarchy, side / 3);
  } while (side != last);
  return sum;
}

std::size_t Pseudonormals::bytes() const {
  return vertices_.size() * sizeof(vertices_[0]) + nextSide_.size() * sizeof(nextSide_[0]);
}

bool isSharp(const bvh::Hierarchy& hierarchy, const Pseudonormals& normals, std::uint32_t slot) {
  bool sharp = false;
  for (std::uint32_t k = 0; k < 3; ++k)
    sharp |= normals.ofVertex(hierarchy.triangles()[slot][k]).norm() < kSharp ||
             normals.ofEdge(hierarchy, slot, k).norm() < kSharp;
  return sharp;
}

}  // namespace hpsdf::sign
