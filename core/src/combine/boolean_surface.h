#pragma once

#include <memory>
#include <vector>

#include "combine/boolean_tree.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::combine {

/// A solid that a closed mesh bounds, with the signed distance to it.
struct MeshSolid {
  std::shared_ptr<const TriangleMesh> mesh;
  std::shared_ptr<const ExactDistance> distance;

  /// Returns true if the outside is in front of each triangle and the inside behind it, and the mesh does not intersect
  /// itself.
  bool hasOrientedTriangles() const { return distance->insideTestChoice().insideTest == InsideTest::pseudonormal; }
};

/// Returns the boundary of a Boolean expression of solids: triangles with the outside in front of them and the inside
/// behind. Triangles that other triangles cross are cut into pieces along the crossings. Pieces have vertices of their
/// own, and their corners may lie on edges of other pieces. All vertices lie on the boundary, up to rounding. Surfaces
/// nearer to each other than about 1e-13 times the largest coordinate count as coincident.
///
/// The triangles do not depend on the number of threads. Throws `Error` (of the kind `mesh`) if nothing is left, (of
/// the kind `limit`) if more than 20 million pairs of triangles cross or the pieces do not fit into memory, and
/// `Cancelled`.
TriangleMesh boundaryOf(const std::vector<MeshSolid>& solids, const BooleanTree& tree, const Progress& progress);

}  // namespace hpsdf::combine
