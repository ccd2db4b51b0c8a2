#pragma once
// What is known of a mesh: counts, measures, and where it is no surface of a solid.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

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

  std::size_t weldedVertices = 0;        ///< removed because another has the same position
  std::size_t unreferencedVertices = 0;  ///< removed because no triangle uses them
  std::size_t degenerateFaces = 0;       ///< dropped: two equal corners or no area
  std::size_t flippedFaces = 0;          ///< had no area but hold a neighbour's edge: mended by flipping that edge
  std::size_t duplicateFaces = 0;        ///< dropped: the same three corners as another
  Vector3 degeneratePosition = Vector3::Zero();  ///< the middle of the first that was dropped, if there is one
  Vector3 duplicatePosition = Vector3::Zero();   ///< likewise
  bool turned = false;                           ///< the whole mesh was turned because its signed volume was negative

  double volume = 0;  ///< signed volume after turning; meaningful for a closed mesh
  double area = 0;
  Box box;

  /// Every edge is used by exactly two triangles that run opposite ways: inside and outside are defined.
  bool closed() const { return faces > 0 && boundaryEdges == 0 && nonManifoldEdges == 0 && inconsistentEdges == 0; }
};

/// Topology and measures of a mesh as it stands (the counts of what cleaning does stay 0).
MeshReport inspect(const TriangleMesh& mesh);

struct ImportedMesh {
  TriangleMesh mesh;
  MeshReport report;
};

/// Two triangles that meet elsewhere than in the corners and edges they share: they pass through each other, touch, or
/// lie on each other.
struct Crossing {
  std::array<std::uint32_t, 2> triangles;  ///< the lower index first
  Vector3 place;                           ///< in both triangles' boxes: the middle of what they share
};

struct Crossings {
  std::vector<Crossing> found;  ///< by their triangles
  bool all = true;              ///< none was left out
};

constexpr std::size_t kMostCrossings = 1'000'000;  ///< unless asked for others

enum class DefectKind : std::uint8_t {
  boundaryEdge,      ///< used by one triangle: the rim of a hole, or of a sheet
  nonManifoldEdge,   ///< used by more than two
  inconsistentEdge,  ///< used by two that run the same way along it: one of them looks the wrong way
  pinchedVertex,     ///< fans of triangles meet in it that share no edge there
  crossing,          ///< two triangles meet beyond what they share
};
constexpr std::size_t kDefectKinds = 5;

struct Defect {
  DefectKind kind;
  std::array<std::uint32_t, 2> faces;  ///< two of those that are there; the same one twice at a boundary
  std::array<Vector3, 2> ends;         ///< of the edge; the same place twice of a vertex or a crossing
};

struct MeshDefects {
  std::vector<Defect> found;  ///< by kind; edges and vertices by their indices, crossings by their triangles
  std::array<std::size_t, kDefectKinds> counts = {};
  bool allCrossings = true;
  /// Of triangles that hang together over edges: the surface folds into itself. But for walls that bodies share, of two
  /// triangles over the same corners.
  std::size_t crossingsWithinParts = 0;
  /// Faces can be turned until no edge is inconsistent.
  bool orientable = true;

  std::size_t count(DefectKind kind) const { return counts[static_cast<std::size_t>(kind)]; }
  std::span<const Defect> of(DefectKind kind) const;
};

/// Everything about a mesh that a solid's surface would not have, with its places. Corners are the same where their
/// indices are: weld them first. `crossings`: of this mesh. Throws `Error` for indices out of range.
MeshDefects findDefects(const TriangleMesh& mesh, const Crossings& crossings);

}  // namespace hpsdf
