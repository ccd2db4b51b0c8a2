#pragma once

#include <cstdint>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"
#include "sign/winding_sign.h"

namespace hpsdf::surface {

/// The outer hull of a mesh (Attene 2010): its triangles except those with the inside of the solid on both sides,
/// such as the inner walls of bodies that overlap.
///
/// A triangle that other triangles intersect is subdivided into quarters, recursively, until no triangle intersects a
/// piece or its length is at most 1/512 of the mesh's size. A piece that no triangle intersects is dropped if both of
/// its sides are inside at its centroid. A piece of the smallest size that is still intersected is dropped if all test
/// points in front of it, behind it and around it are inside. If more than 250,000 additional pieces are needed, the
/// smallest size is doubled, up to 1/32. In meshes with holes the winding number varies along a piece. Such a piece is
/// subdivided until it is certain that both of its sides are inside, and is kept if this remains uncertain.
struct OuterHull {
  TriangleMesh mesh;
  std::vector<std::uint32_t> sourceTriangles;  ///< for each triangle of the hull, the mesh triangle that contains it
};

/// Makes the outer hull of `mesh`, from which `hierarchy` and `winding` were made. Throws an `Error` that names the
/// mesh if more than two million pairs of triangles intersect, if there are too many pieces even with the smallest
/// size 1/32, or if no triangle is left. Throws `Cancelled` when `progress` says so.
OuterHull makeOuterHull(const bvh::Hierarchy& hierarchy, const TriangleMesh& mesh, const sign::WindingSign& winding,
                        const Progress& progress);

}  // namespace hpsdf::surface
