#pragma once

#include <span>
#include <vector>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

/// Returns true for triangles with the same corners, whatever their orientation.
bool haveSameCorners(const Triangle& one, const Triangle& other);

/// Marks the triangles to drop, with 1, where several triangles have the same corners.
///
/// Where all of them have one orientation, one stays. More stay where bodies share them, so that dropping them would
/// leave more edges unbalanced; of these, duplicates that unbalance edges are dropped.
///
/// Where both orientations occur, the triangles that are connected by edges are one of two things:
/// - a shared wall, if the surrounding triangles balance its edges without it. One triangle of each orientation stays,
///   so that each body is closed;
/// - otherwise a surface that is modelled with both sides, as drawing programs do. One triangle stays: the first with
///   the more frequent orientation.
std::vector<char> redundantFaces(std::span<const Triangle> triangles);

}  // namespace hpsdf::mesh
