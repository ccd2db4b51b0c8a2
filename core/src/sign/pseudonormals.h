#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bvh/hierarchy.h"

namespace hpsdf::distance {

/// Angle-weighted pseudonormals (Bærentzen & Aanæs 2005) of a hierarchy's triangles, not normalised: only the sign of a
/// product is asked of them. Triangles without area do not contribute.
///
/// A vertex's is kept, an edge's is summed when asked for: it is needed only where all triangles at the edge are the
/// nearest, and the search has just visited them.
class Pseudonormals {
 public:
  Pseudonormals() = default;
  explicit Pseudonormals(const Hierarchy& hierarchy);

  /// Sum of corner angle times unit normal.
  const Vector3& ofVertex(std::uint32_t vertex) const { return vertices_[vertex]; }

  /// Sum of the unit normals of all triangles at the edge of the triangle in a slot; edge k runs from corner k to
  /// corner k + 1. `hierarchy`: that of the constructor.
  Vector3 ofEdge(const Hierarchy& hierarchy, std::uint32_t slot, std::uint32_t k) const;

  std::size_t bytes() const;

 private:
  std::vector<Vector3> vertices_;
  /// For each side, number 3·slot + k: the next one at the same edge, in the order of the mesh's triangles, after the
  /// last the first.
  std::vector<std::uint32_t> nextSide_;
};

}  // namespace hpsdf::distance
