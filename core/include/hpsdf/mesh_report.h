#pragma once

#include <cstddef>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// What is known about a mesh after import. Counts of edges are of undirected edges.
struct MeshReport {
  std::size_t vertices = 0;  ///< after welding, used by at least one triangle
  std::size_t faces = 0;     ///< triangles kept
  std::size_t parts = 0;     ///< connected components (over shared edges)

  std::size_t boundaryEdges = 0;      ///< used by one triangle
  std::size_t nonManifoldEdges = 0;   ///< used by more than two triangles
  std::size_t inconsistentEdges = 0;  ///< used by two triangles that run the same way along it

  /// Run along by more triangles one way than the other: the rims of holes, and where faces look the wrong way. Without
  /// any, winding numbers are whole, and inside and outside are told apart though edges may be non-manifold.
  std::size_t unbalancedEdges = 0;

  std::size_t weldedVertices = 0;             ///< removed because another has the same position
  std::size_t unreferencedVertices = 0;       ///< removed because no triangle uses them
  std::size_t degenerateFaces = 0;            ///< dropped: two equal corners or no area
  std::size_t flippedFaces = 0;               ///< had no area but hold a neighbour's edge: mended by flipping that edge
  std::size_t duplicateFaces = 0;             ///< dropped: the same three corners as another
  Vector3 degeneratePlace = Vector3::Zero();  ///< the middle of the first that was dropped, if there is one
  Vector3 duplicatePlace = Vector3::Zero();   ///< likewise
  bool turned = false;                        ///< the whole mesh was turned because its signed volume was negative

  double volume = 0;  ///< signed volume after turning; meaningful for a closed mesh
  double area = 0;
  Box box;

  /// Every edge is used by exactly two triangles that run opposite ways: inside and outside are defined.
  bool closed() const { return faces > 0 && boundaryEdges == 0 && nonManifoldEdges == 0 && inconsistentEdges == 0; }
};

/// Topology and measures of a mesh as it stands (the counts of what cleaning does stay 0).
MeshReport inspect(const TriangleMesh& mesh);

}  // namespace hpsdf
