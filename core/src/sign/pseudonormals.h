#pragma once

#include <array>
#include <cstdint>

#include "bvh/hierarchy.h"
#include "util/shared_array.h"

namespace hpsdf::sign {

/// Angle-weighted pseudonormals (Bærentzen & Aanæs 2005) of a hierarchy's triangles. They are not
/// normalised, because only the signs of dot products with them are used. Triangles without area do not
/// contribute.
///
/// Vertex pseudonormals are stored. Edge pseudonormals are summed on demand: a query needs one only if the closest
/// point lies on the edge, and then the search has just visited the triangles at the edge.
class Pseudonormals {
 public:
  Pseudonormals() = default;
  explicit Pseudonormals(const bvh::Hierarchy& hierarchy);

  /// Returns the sum of corner angle times unit normal over the triangles at a vertex.
  const Vector3& ofVertex(std::uint32_t vertex) const { return vertices_[vertex]; }

  /// Returns the sum of the unit normals of all triangles at an edge. The edge is side k of the triangle in `slot`,
  /// from the triangle's corner k to its corner k + 1. `hierarchy` must be the one that the constructor received.
  Vector3 ofEdge(const bvh::Hierarchy& hierarchy, std::uint32_t slot, std::uint32_t k) const;

  std::size_t bytes() const;

  /// Calls visit(array) for each array of pseudonormals. Those into which they are copied are equal to the original.
  template <typename Self, typename Visit>
  static void forEachMember(Self& self, const Visit& visit) {
    visit(self.vertices_);
    visit(self.nextSide_);
  }

 private:
  detail::SharedArray<Vector3> vertices_;
  /// For each triangle side, with the number 3·slot + k, the number of the next side at the same edge. The sides at an
  /// edge form a cycle in the order of the mesh's triangles.
  detail::SharedArray<std::uint32_t> nextSide_;
};

/// Returns true if the pseudonormal of a vertex or edge of the triangle in `slot` is dominated by rounding errors.
bool isSharp(const bvh::Hierarchy& hierarchy, const Pseudonormals& normals, std::uint32_t slot);

}  // namespace hpsdf::sign
