#pragma once
// Contours must not have the defects that are found here: holes, non-manifold edges and vertices, crossings.

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>

#include "hpsdf/detail/crossings.h"
#include "hpsdf/mesh_report.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::support {

/// Returns true if two triangles have corners at the same position.
inline bool shareAPosition(const TriangleMesh& mesh, const std::array<std::uint32_t, 2>& triangles) {
  const auto one = cornersOf(mesh, mesh.triangles[triangles[0]]), other = cornersOf(mesh, mesh.triangles[triangles[1]]);
  return std::ranges::any_of(one, [&](const Vector3& x) { return std::ranges::find(other, x) != other.end(); });
}

/// Returns the defects of a mesh in words, or "" for a closed manifold without crossings. If it may be open, edges on
/// its boundary do not count, and triangles with different vertices at one position do not cross.
inline std::string contourDefects(const TriangleMesh& mesh, bool mayBeOpen = false) {
  Crossings crossings = findCrossings(mesh);
  if (mayBeOpen)
    std::erase_if(crossings.found, [&](const Crossing& one) { return shareAPosition(mesh, one.triangles); });
  const MeshDefects defects = findDefects(mesh, crossings);
  std::string text;
  const auto add = [&](DefectKind kind, const char* name) {
    if (defects.count(kind) > 0) text += std::to_string(defects.count(kind)) + " " + name + "; ";
  };
  if (!mayBeOpen) add(DefectKind::boundaryEdge, "boundary edges");
  add(DefectKind::nonManifoldEdge, "non-manifold edges");
  add(DefectKind::inconsistentEdge, "inconsistent edges");
  add(DefectKind::pinchedVertex, "pinched vertices");
  add(DefectKind::crossing, "crossings");
  return text;
}

}  // namespace hpsdf::support
