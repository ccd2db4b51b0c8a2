#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::distance {

/// Angle-weighted pseudonormals (Bærentzen & Aanæs 2005), not normalised: only the sign of a product is asked of them.
/// Triangles without area, whose unit normal is given as zero, do not contribute.
struct Pseudonormals {
  std::vector<Vector3> edges;     ///< sum of the unit normals of all triangles at the edge
  std::vector<Vector3> vertices;  ///< sum of corner angle times unit normal
  /// A mesh triangle's edges as places in `edges`; edge k runs from corner k to corner k + 1.
  std::vector<std::array<std::uint32_t, 3>> triangleEdges;
};

Pseudonormals makePseudonormals(const TriangleMesh& mesh, const std::vector<Vector3>& unitNormals);

}  // namespace hpsdf::distance
