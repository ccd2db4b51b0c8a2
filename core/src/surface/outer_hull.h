#pragma once

#include <cstdint>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"
#include "sign/winding_sign.h"

namespace hpsdf::surface {

/// The outer hull of a mesh (Attene 2010): the mesh without the parts that have the inside of the solid on both sides,
/// such as the inner walls of bodies that overlap.
///
/// A triangle that other triangles intersect is subdivided into quarters, recursively. The subdivision of a piece ends
/// when no triangle intersects the piece, or when its longest side is at most 1/512 of the mesh's size. This limit is
/// doubled, up to 1/32, while more than 250,000 additional pieces are needed. A piece that no triangle intersects is
/// dropped if the points directly in front of its centroid and behind it are inside. An intersected piece is dropped if
/// all test points in front of it, behind it and around it are inside. Near holes of the mesh, the winding number
/// varies along a piece. There, a piece is subdivided further until both of its sides are certainly inside, and is kept
/// if this remains uncertain.
struct OuterHull {
  TriangleMesh mesh;
  std::vector<std::uint32_t> sourceTriangles;  ///< for each triangle of the hull, the mesh triangle that contains it
};

/// Makes the outer hull of `mesh`. `hierarchy` and `winding` must have been made from the same mesh. Throws an `Error`
/// that names the mesh if more than two million pairs of triangles intersect, if there are too many pieces even with
/// the smallest size 1/32, or if no triangle is left. Throws `Cancelled` if `progress` requests it.
OuterHull makeOuterHull(const bvh::Hierarchy& hierarchy, const TriangleMesh& mesh, const sign::WindingSign& winding,
                        const Progress& progress);

}  // namespace hpsdf::surface
