#pragma once

#include <span>
#include <vector>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

/// Returns true if two triangles have the same three vertices, in any order.
bool haveSameCorners(const Triangle& one, const Triangle& other);

/// Returns 1 for each triangle to drop and 0 for each triangle to keep. Only duplicates are dropped: triangles
/// that share their three corners with another triangle. An edge is balanced if equally many triangles run along
/// it in both directions.
///
/// If all triangles with the same corners have the same orientation, one of them is kept. An exception are triangles
/// that several bodies share: if keeping only one would leave more edges unbalanced, duplicates are dropped one by one,
/// and only while this reduces the number of unbalanced edges.
///
/// Triangles with the same corners and both orientations form sets that are connected by edges. Each set is one
/// of two things:
/// - a shared wall of two bodies, if the surrounding triangles alone balance the edges of the set. One triangle
///   of each orientation is kept, so that each body is closed;
/// - otherwise a surface that is modelled with both sides, as drawing programs do. One triangle is kept: the
///   first one with the more frequent orientation.
std::vector<char> redundantFaces(std::span<const Triangle> triangles);

}  // namespace hpsdf::mesh
