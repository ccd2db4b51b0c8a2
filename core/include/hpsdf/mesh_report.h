#pragma once
// The state of a mesh: counts, measures, and the defects by which it is not the surface of a solid.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// Counts and measures of a mesh after import. Edges are counted without direction.
struct MeshReport {
  std::size_t vertices = 0;    ///< vertices after welding that at least one triangle uses
  std::size_t faces = 0;       ///< triangles kept
  std::size_t components = 0;  ///< sets of triangles that are connected by shared edges

  std::size_t boundaryEdges = 0;      ///< edges of one triangle
  std::size_t nonManifoldEdges = 0;   ///< edges of more than two triangles
  std::size_t inconsistentEdges = 0;  ///< edges that two triangles run along in the same direction

  /// Edges that more triangles run along in one direction than in the other: the boundary of holes, and edges where the
  /// orientation is wrong. Without any, winding numbers are whole numbers, so that inside and outside are defined
  /// even where edges are non-manifold.
  std::size_t unbalancedEdges = 0;

  std::size_t weldedVertices = 0;                ///< vertices removed because another has the same position
  std::size_t unreferencedVertices = 0;          ///< vertices removed because no triangle uses them
  std::size_t degenerateFaces = 0;               ///< triangles dropped for two equal corners or no area
  std::size_t flippedFaces = 0;                  ///< degenerate triangles replaced by an edge flip
  std::size_t duplicateFaces = 0;                ///< triangles dropped for having the same three corners as another
  Vector3 degeneratePosition = Vector3::Zero();  ///< centroid of the first degenerate triangle dropped, if any
  Vector3 duplicatePosition = Vector3::Zero();   ///< centroid of the first duplicate triangle dropped, if any
  bool reversed = false;                         ///< the whole mesh was reversed: its signed volume was negative

  double volume = 0;  ///< signed volume after reversal, in cubed mesh units; meaningful for a closed mesh
  double area = 0;    ///< surface area, in squared mesh units
  Box box;            ///< bounding box, in mesh units

  /// Every edge belongs to exactly two triangles that run along it in opposite directions.
  bool closed() const { return faces > 0 && boundaryEdges == 0 && nonManifoldEdges == 0 && inconsistentEdges == 0; }
};

/// Returns the counts and measures of a mesh as it is; the counts of what cleaning removes are 0. Throws `Error`
/// (mesh) for indices out of range.
MeshReport inspect(const TriangleMesh& mesh);

/// A mesh after import, and the report on it.
struct ImportedMesh {
  TriangleMesh mesh;
  MeshReport report;
};

/// Two triangles that intersect beyond the corners and edges they share: they pass through each other, touch, or
/// overlap in one plane.
struct Crossing {
  std::array<std::uint32_t, 2> triangles;  ///< indices in the mesh, the lower one first
  Vector3 position;                        ///< the middle of the intersection of the triangles' boxes
};

struct Crossings {
  std::vector<Crossing> found;  ///< sorted by triangle indices
  bool complete = true;         ///< false when the search stopped at its limit
};

constexpr std::size_t kMaxCrossings = 1'000'000;  ///< default limit of a search for crossings

enum class DefectKind : std::uint8_t {
  boundaryEdge,      ///< an edge of one triangle: the boundary of a hole or of a sheet
  nonManifoldEdge,   ///< an edge of more than two triangles
  inconsistentEdge,  ///< an edge of two triangles that run along it in the same direction: one is reversed
  pinchedVertex,     ///< a vertex at which fans of triangles meet that share no edge there
  crossing,          ///< two triangles that intersect beyond the corners and edges they share
};
constexpr std::size_t kDefectKinds = 5;

struct Defect {
  DefectKind kind;
  std::array<std::uint32_t, 2> faces;  ///< two of the triangles involved; equal at a boundary edge
  std::array<Vector3, 2> ends;         ///< end points of the edge; equal for a vertex or a crossing
};

struct MeshDefects {
  std::vector<Defect> found;  ///< sorted by kind; edges and vertices by vertex index, crossings by triangle index
  std::array<std::size_t, kDefectKinds> counts = {};
  bool allCrossings = true;  ///< false when the search for crossings stopped at its limit
  /// Crossings of two triangles of one component, at which the surface folds into itself. Shared walls are not counted.
  std::size_t crossingsWithinComponents = 0;
  /// True if reversing triangles can make every edge of two triangles consistent; false for a Möbius strip.
  bool orientable = true;

  std::size_t count(DefectKind kind) const { return counts[static_cast<std::size_t>(kind)]; }
  std::span<const Defect> ofKind(DefectKind kind) const;
};

/// Finds every defect of a mesh by which it is not the surface of a solid, with its position. Triangles share a corner
/// where its index is the same, so that the mesh must be welded. `crossings` are those of this mesh. Throws `Error`
/// (mesh) for indices out of range.
MeshDefects findDefects(const TriangleMesh& mesh, const Crossings& crossings);

}  // namespace hpsdf
