#pragma once
// The triangles in which two meshes differ.

#include <cstddef>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::rebuilding {

struct MeshChange {
  /// The triangles that only the first mesh has, turned over, then those that only the second one has. Where neither
  /// mesh has holes, the winding number of these triangles is the difference of the winding numbers of the two meshes.
  TriangleMesh triangles;
  std::size_t removed = 0;  ///< number of triangles that only the first mesh has
};

/// Returns true if there are edges along which more triangles run in one direction than in the other.
bool hasHoles(const TriangleMesh& mesh);

/// Compares two meshes. Triangles are the same if they have the same corners in the same cyclic order. A triangle that
/// a mesh has several times counts as often.
MeshChange changeBetween(const TriangleMesh& before, const TriangleMesh& after);

}  // namespace hpsdf::rebuilding
