#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bvh/hierarchy.h"

namespace hpsdf::sign {

/// Angle-weighted pseudonormals (Bærentzen & Aanæs 2005) of a hierarchy's triangles, not normalised, because only the
/// signs of dot products with them are used. Triangles without area do not contribute.
///
/// Vertex pseudonormals are stored. Edge pseudonormals are summed on demand: a query needs one only where all triangles
/// at the edge are the nearest, and its search has just visited these.
class Pseudonormals {
 public:
  Pseudonormals() = default;
  explicit Pseudonormals(const bvh::Hierarchy& hierarchy);

  /// Returns the sum of corner angle times unit normal over the triangles at a vertex.
  const Vector3& ofVertex(std::uint32_t vertex) const { return vertices_[vertex]; }

  /// Returns the sum of the unit normals of all triangles at edge k of the triangle in a slot, which runs from corner k
  /// to corner k + 1. `hierarchy` is that of the constructor.
  Vector3 ofEdge(const bvh::Hierarchy& hierarchy, std::uint32_t slot, std::uint32_t k) const;

  std::size_t bytes() const;

 private:
  std::vector<Vector3> vertices_;
  /// For each side, number 3·slot + k, the next side at the same edge: a cycle in the order of the mesh's triangles.
  std::vector<std::uint32_t> nextSide_;
};

}  // namespace hpsdf::sign
