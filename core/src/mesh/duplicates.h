#pragma once

#include <span>
#include <vector>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

/// Returns true for triangles with the same corners, whatever their orientation.
bool haveSameCorners(const Triangle& one, const Triangle& other);

/// Returns 1 for each triangle to drop and 0 for each triangle to keep. Only triangles that share their three
/// corners with another triangle are dropped.
///
/// If all triangles with the same corners have the same orientation, one is kept. More are kept if bodies share
/// them, so that dropping them would leave more edges unbalanced. Of those, duplicates that unbalance edges are
/// dropped.
///
/// If the triangles with the same corners have both orientations, the set of such triangles that are connected
/// by edges is one of two things:
/// - a shared wall, if the surrounding triangles balance its edges without it. One triangle of each orientation
///   is kept, so that each body is closed;
/// - otherwise a surface that is modelled with both sides, as drawing programs do. One triangle is kept: the
///   first one with the more frequent orientation.
std::vector<char> redundantFaces(std::span<const Triangle> triangles);

}  // namespace hpsdf::mesh
