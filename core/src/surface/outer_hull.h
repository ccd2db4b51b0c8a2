#pragma once

#include <cstdint>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"
#include "sign/inside.h"

namespace hpsdf::distance {

/// What of a mesh is between outside and inside: its triangles without those that have the inside on both sides, such
/// as walls within bodies that overlap.
///
/// A triangle that others meet within its sides is cut into quarters, and these again, until a piece is met by none, so
/// that each of its sides is of one kind, or is a five-hundredth of the mesh's size: such a piece stays where a place
/// before it, behind it or around it is outside. Where that would make more than 250,000 pieces, they are coarser, up
/// to a thirty-second. Of a mesh with holes, the winding number changes along a piece: it stays as well where its
/// middle is no wall, and is cut on until it is certain to be one.
struct Hull {
  TriangleMesh mesh;
  std::vector<std::uint32_t> triangles;  ///< of each, the index of that in the whole mesh of which it is a part
};

/// `hierarchy`: of the mesh; `inside`: made of that. Throws `Error`, naming the mesh, where it meets itself in too many
/// places, and where nothing is left; `Cancelled`.
Hull hullOf(const Hierarchy& hierarchy, const TriangleMesh& mesh, const Inside& inside, const Progress& progress);

}  // namespace hpsdf::distance
