#pragma once
// Connectivity of a mesh: the directed edges of its triangles, and sets of triangles that are connected by edges.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

/// An edge of one triangle with its direction (half-edge).
struct DirectedEdge {
  std::uint64_t edge;  ///< undirected edge: smaller vertex index in the high half, greater one in the low half
  std::uint32_t face;  ///< index of the triangle
  bool rising;         ///< true if the edge runs from its smaller to its greater vertex index

  std::uint32_t low() const { return static_cast<std::uint32_t>(edge >> 32); }
  std::uint32_t high() const { return static_cast<std::uint32_t>(edge); }
};

/// Returns the directed edges of all triangles, sorted by undirected edge and then by triangle. Edges that begin
/// and end at the same vertex are left out.
std::vector<DirectedEdge> directedEdgesOf(std::span<const Triangle> triangles);

/// Calls visit(half-edges) once for each undirected edge of a mesh, with all directed edges (half-edges) along
/// it. The list `edges` must be sorted by undirected edge.
template <typename Visit>
void forEachEdge(std::span<const DirectedEdge> edges, const Visit& visit) {
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end].edge == edges[begin].edge) ++end;
    visit(edges.subspan(begin, end - begin));
  }
}

/// Union-find with path halving: disjoint sets of the numbers from 0 up to a given count. Each number starts in a
/// set of its own.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t elements) : parent_(elements), sets_(elements) {
    std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
  }

  /// Unites the sets that contain a and b.
  void join(std::uint32_t a, std::uint32_t b) {
    a = first(a);
    b = first(b);
    if (a == b) return;
    parent_[std::max(a, b)] = std::min(a, b);
    --sets_;
  }

  /// The number of sets.
  std::size_t count() const { return sets_; }

  /// Returns the lowest element of the set that contains `element`.
  std::uint32_t first(std::uint32_t element) {
    while (parent_[element] != element) element = parent_[element] = parent_[parent_[element]];
    return element;
  }

 private:
  std::vector<std::uint32_t> parent_;
  std::size_t sets_;
};

/// Returns the connected components of a surface: sets of triangles that are connected by shared edges, no matter
/// how many triangles share an edge. `faces` is the number of triangles, and `edges` holds their directed edges,
/// sorted by undirected edge.
DisjointSets componentsOf(std::size_t faces, std::span<const DirectedEdge> edges);

/// The patches of a surface. A patch is a set of triangles that are connected across edges of exactly two triangles. A
/// patch can be oriented consistently by reversing some of its triangles, unless it is one-sided like a Möbius strip.
struct Patches {
  std::size_t count = 0;
  std::vector<std::uint32_t> patchOf;  ///< index of each triangle's patch; patches are sorted by their first triangle
  std::vector<char> against;           ///< 1 for a triangle oriented opposite to the first triangle of its patch
  std::vector<char> oneSided;          ///< 1 for a patch that has no consistent orientation
};

/// Returns the patches of a surface. `faces` is the number of triangles, and `edges` holds their directed edges,
/// sorted by undirected edge.
Patches patchesOf(std::size_t faces, std::span<const DirectedEdge> edges);

}  // namespace hpsdf::mesh
