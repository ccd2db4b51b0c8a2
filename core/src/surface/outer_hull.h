#pragma once

#include <cstdint>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"
#include "sign/winding_sign.h"

namespace hpsdf::surface {

/// The outer hull of a mesh: its triangles except those with the inside on both sides, such as inner walls
/// of bodies that overlap (Attene 2010).
///
/// A triangle that other triangles intersect is subdivided into quarters, recursively. A piece is not
/// subdivided further if no triangle intersects it, or if it is no longer than 1/512 of the mesh's size.
/// Pieces that no triangle intersects are classified at their centroid. Pieces of the smallest size are
/// kept if any probe in front of them, behind them or around them is outside. If more than 250,000 pieces
/// are needed, the smallest size is doubled, up to 1/32. In meshes with holes the winding number varies
/// along a piece. There, pieces are subdivided until it is certain that both of their sides are inside;
/// pieces are kept if this remains uncertain.
struct OuterHull {
  TriangleMesh mesh;
  std::vector<std::uint32_t> sourceTriangles;  ///< for each triangle, the index of the original one that contains it
};

/// Makes the outer hull. `hierarchy` and `winding` belong to `mesh`. Throws `Error`, which names the mesh,
/// if the mesh has more than two million crossings, if there are too many pieces even with the smallest
/// size 1/32, or if no triangle is left. Throws `Cancelled`.
OuterHull makeOuterHull(const bvh::Hierarchy& hierarchy, const TriangleMesh& mesh, const sign::WindingSign& winding,
                        const Progress& progress);

}  // namespace hpsdf::surface
