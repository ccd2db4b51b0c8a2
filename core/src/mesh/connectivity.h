#pragma once
// Connectivity of a mesh: the directed edges of its triangles, and the components and patches that edges
// connect.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

/// One edge of one triangle, with its direction.
struct DirectedEdge {
  std::uint64_t edge;  ///< key of the undirected edge: lower vertex in the high half, higher vertex in the low half
  std::uint32_t face;  ///< index of the triangle
  bool rising;         ///< the direction is from the lower to the higher vertex

  std::uint32_t low() const { return static_cast<std::uint32_t>(edge >> 32); }
  std::uint32_t high() const { return static_cast<std::uint32_t>(edge); }
};

/// The directed edges of all triangles, sorted by undirected edge and then by face. Edges between equal vertices are
/// left out.
std::vector<DirectedEdge> directedEdgesOf(std::span<const Triangle> triangles);

/// Calls visit once for each undirected edge of the mesh, with all directed edges that belong to it. The given
/// list must be sorted by undirected edge.
template <typename Visit>
void forEachEdge(std::span<const DirectedEdge> edges, const Visit& visit) {
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end].edge == edges[begin].edge) ++end;
    visit(edges.subspan(begin, end - begin));
  }
}

/// Disjoint sets of the numbers below `elements`, by union-find with path halving. Each number starts in its own set.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t elements) : parent_(elements), sets_(elements) {
    std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
  }

  /// Unites the sets of two elements.
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

/// Returns the components of a surface. A component is a set of triangles that are connected by edges, however
/// many triangles share an edge. `edges` are the directed edges of `faces` triangles, sorted by undirected
/// edge.
DisjointSets componentsOf(std::size_t faces, std::span<const DirectedEdge> edges);

/// The patches of a surface. A patch is a set of triangles that are connected by edges of exactly two
/// triangles. Reversing some triangles of a patch can make all its orientations consistent, unless the patch is
/// one-sided like a Möbius strip.
struct Patches {
  std::size_t count = 0;
  std::vector<std::uint32_t> patchOf;  ///< the patch of each triangle; patches are numbered by their lowest triangles
  std::vector<char> against;           ///< 1 for triangles oriented opposite to their patch's lowest triangle
  std::vector<char> oneSided;          ///< 1 for patches that have no consistent orientation
};

/// Returns the patches of a surface. `edges` are the directed edges of `faces` triangles, sorted by undirected
/// edge.
Patches patchesOf(std::size_t faces, std::span<const DirectedEdge> edges);

}  // namespace hpsdf::mesh
