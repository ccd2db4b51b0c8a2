#pragma once
// The triangles in which two meshes differ.

#include <cstddef>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::rebuilding {

struct MeshChange {
  /// The triangles that only the first mesh has, then those that only the second one has. Equal vertices are one.
  TriangleMesh triangles;
  std::size_t removed = 0;  ///< number of triangles that only the first mesh has
  /// True if the edges of holes differ: edges along which more triangles run in one direction than in the other.
  bool movesHoles = false;
};

/// Compares two meshes. Triangles are the same if they have the same corners in the same cyclic order. A triangle that
/// a mesh has several times counts as often.
MeshChange changeBetween(const TriangleMesh& before, const TriangleMesh& after);

}  // namespace hpsdf::rebuilding
