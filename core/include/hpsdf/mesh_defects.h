#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/crossings.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf {

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
