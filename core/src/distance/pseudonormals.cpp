#include "distance/pseudonormals.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace hpsdf::distance {
namespace {

/// A triangle's side, filed under the lower of its two vertices.
struct Side {
  std::uint32_t higherVertex;
  std::uint32_t triangle;
  std::uint32_t number;
};

/// All sides by their lower vertex: those of v are [first[v], first[v + 1]).
struct SidesByVertex {
  std::vector<std::size_t> first;
  std::vector<Side> sides;
};

SidesByVertex groupSides(const TriangleMesh& mesh) {
  SidesByVertex grouped{std::vector<std::size_t>(mesh.vertices.size() + 1, 0), {}};
  const auto forEachSide = [&](auto&& visit) {
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
      for (std::uint32_t k = 0; k < 3; ++k) {
        const auto [low, high] = std::minmax({mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]});
        visit(low, Side{high, t, k});
      }
  };
  forEachSide([&](std::uint32_t low, const Side&) { ++grouped.first[low + 1]; });
  for (std::size_t v = 1; v < grouped.first.size(); ++v) grouped.first[v] += grouped.first[v - 1];
  grouped.sides.resize(grouped.first.back());
  std::vector<std::size_t> next(grouped.first.begin(), grouped.first.end() - 1);
  forEachSide([&](std::uint32_t low, const Side& side) { grouped.sides[next[low]++] = side; });
  return grouped;
}

void sumAtEdges(const TriangleMesh& mesh, const std::vector<Vector3>& unitNormals, Pseudonormals& result) {
  SidesByVertex grouped = groupSides(mesh);
  result.triangleEdges.resize(mesh.triangles.size());
  result.edges.reserve(mesh.triangles.size() * 3 / 2);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const auto begin = grouped.sides.begin() + static_cast<std::ptrdiff_t>(grouped.first[v]);
    const auto end = grouped.sides.begin() + static_cast<std::ptrdiff_t>(grouped.first[v + 1]);
    std::sort(begin, end, [](const Side& a, const Side& b) {
      return std::pair(a.higherVertex, a.triangle) < std::pair(b.higherVertex, b.triangle);
    });
    for (auto side = begin; side != end; ++side) {
      if (side == begin || side->higherVertex != (side - 1)->higherVertex) result.edges.push_back(Vector3::Zero());
      result.edges.back() += unitNormals[side->triangle];
      result.triangleEdges[side->triangle][side->number] = static_cast<std::uint32_t>(result.edges.size() - 1);
    }
  }
}

void sumAtVertices(const TriangleMesh& mesh, const std::vector<Vector3>& unitNormals, Pseudonormals& result) {
  result.vertices.assign(mesh.vertices.size(), Vector3::Zero());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const Vector3& corner = mesh.vertices[mesh.triangles[t][k]];
      const Vector3 next = mesh.vertices[mesh.triangles[t][(k + 1) % 3]] - corner;
      const Vector3 previous = mesh.vertices[mesh.triangles[t][(k + 2) % 3]] - corner;
      const double angle = std::atan2(next.cross(previous).norm(), next.dot(previous));
      result.vertices[mesh.triangles[t][k]] += angle * unitNormals[t];
    }
}

}  // namespace

Pseudonormals makePseudonormals(const TriangleMesh& mesh, const std::vector<Vector3>& unitNormals) {
  Pseudonormals result;
  tbb::parallel_invoke([&] { sumAtEdges(mesh, unitNormals, result); },
                       [&] { sumAtVertices(mesh, unitNormals, result); });
  return result;
}

}  // namespace hpsdf::distance
