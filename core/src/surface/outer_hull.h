#pragma once

#include <cstdint>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"
#include "sign/winding_sign.h"

namespace hpsdf::surface {

/// The outer hull of a mesh: its triangles without those that have the inside on both sides, such as inner walls of
/// bodies that overlap (Attene 2010).
///
/// A triangle that others intersect is subdivided into quarters until no triangle intersects a piece, or the piece is
/// no longer than 1/512 of the mesh's size. Pieces without intersection are classified at their centroid. Smallest
/// pieces are kept if any probe in front of them, behind them or around them is outside. If this needs more than
/// 250,000 pieces, the limit of size doubles, up to 1/32. In meshes with holes the winding number varies along a piece:
/// pieces are then subdivided until it is certain that both sides are inside, and kept where that stays unknown.
struct OuterHull {
  TriangleMesh mesh;
  std::vector<std::uint32_t> sourceTriangles;  ///< for each triangle, the index of the original one that contains it
};

/// `hierarchy` and `winding` are those of the mesh. Throws `Error`, naming the mesh, if it has more than two million
/// crossings, if pieces of 1/32 are still too many, or if nothing is left. Throws `Cancelled`.
OuterHull makeOuterHull(const bvh::Hierarchy& hierarchy, const TriangleMesh& mesh, const sign::WindingSign& winding,
                        const Progress& progress);

}  // namespace hpsdf::surface
