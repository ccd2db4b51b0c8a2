#pragma once
// Statistics of a mesh, and the defects that keep the mesh from being the surface of a solid.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// Statistics of a mesh after import: counts, volume, area and bounding box. Edges are undirected: an edge counts once,
/// no matter how many triangles share it.
struct MeshReport {
  std::size_t vertices = 0;    ///< vertices after welding that at least one triangle uses
  std::size_t faces = 0;       ///< number of triangles in the mesh
  std::size_t components = 0;  ///< sets of triangles that are connected by shared edges

  std::size_t boundaryEdges = 0;      ///< edges that belong to only one triangle
  std::size_t nonManifoldEdges = 0;   ///< edges that belong to more than two triangles
  std::size_t inconsistentEdges = 0;  ///< edges that two triangles traverse in the same direction

  /// Number of edges that more triangles traverse in one direction than in the other: edges at holes, and edges at
  /// which neighbouring triangles have opposite orientations. If there are none, winding numbers are whole numbers.
  /// Inside and outside are then defined even if some edges are non-manifold.
  std::size_t unbalancedEdges = 0;

  std::size_t weldedVertices = 0;                ///< vertices removed because another vertex has the same position
  std::size_t unreferencedVertices = 0;          ///< vertices removed because no triangle uses them
  std::size_t degenerateFaces = 0;               ///< triangles dropped because two corners are equal or the area is 0
  std::size_t flippedFaces = 0;                  ///< degenerate triangles replaced by an edge flip
  std::size_t duplicateFaces = 0;                ///< triangles dropped because another triangle has the same corners
  Vector3 degeneratePosition = Vector3::Zero();  ///< centroid of the first degenerate triangle dropped, if any
  Vector3 duplicatePosition = Vector3::Zero();   ///< centroid of the first duplicate triangle dropped, if any
  bool reversed = false;                         ///< the whole mesh was reversed: its signed volume was negative

  double volume = 0;  ///< signed volume after reversal, in cubed mesh units; meaningful for a closed mesh
  double area = 0;    ///< surface area, in squared mesh units
  Box box;            ///< bounding box, in mesh units

  /// Returns true if every edge belongs to exactly two triangles, which traverse it in opposite directions.
  bool closed() const { return faces > 0 && boundaryEdges == 0 && nonManifoldEdges == 0 && inconsistentEdges == 0; }
};

/// Returns the statistics of a mesh without changing it. The counts of items that cleaning removes are 0. Throws
/// `Error` (of the kind `mesh`) for indices out of range.
MeshReport inspect(const TriangleMesh& mesh);

/// A mesh after import, together with the report on this mesh.
struct ImportedMesh {
  TriangleMesh mesh;
  MeshReport report;
};

/// Two triangles of a mesh that pass through each other, touch, or overlap in one plane. Corners and edges that
/// the two triangles share do not count as contact.
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
  inconsistentEdge,  ///< an edge that its two triangles traverse in the same direction: one of them is reversed
  pinchedVertex,     ///< a vertex at which fans of triangles meet without a common edge
  crossing,          ///< two triangles that intersect beyond the corners and edges they share
};
constexpr std::size_t kDefectKinds = 5;

struct Defect {
  DefectKind kind;
  std::array<std::uint32_t, 2> faces;  ///< two of the triangles involved; equal at a boundary edge
  std::array<Vector3, 2> ends;         ///< end points of the edge; equal for a vertex or a crossing
};

struct MeshDefects {
  std::vector<Defect> found;  ///< sorted by kind, then edges and vertices by vertex index, crossings by triangle index
  std::array<std::size_t, kDefectKinds> counts = {};
  bool allCrossings = true;  ///< false when the search for crossings stopped at its limit
  /// Number of crossings between two triangles of the same component, at which the surface passes through itself. Walls
  /// that two bodies share are not counted.
  std::size_t crossingsWithinComponents = 0;
  /// True if the triangles can be oriented consistently at every edge that exactly two triangles share; false for a
  /// Möbius strip.
  bool orientable = true;

  std::size_t count(DefectKind kind) const { return counts[static_cast<std::size_t>(kind)]; }
  std::span<const Defect> ofKind(DefectKind kind) const;
};

/// Finds all defects that keep a mesh from being the surface of a solid, with their positions. The mesh must be welded,
/// because triangles share a corner only if they use the same vertex index. `crossings` are the self-intersections of
/// this mesh. Throws `Error` (of the kind `mesh`) for indices out of range.
MeshDefects findDefects(const TriangleMesh& mesh, const Crossings& crossings);

}  // namespace hpsdf
