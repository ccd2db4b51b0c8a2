#pragma once

#include "bvh/hierarchy.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"
#include "sign/inside.h"
#include "sign/pseudonormals.h"

namespace hpsdf::distance {

/// A choice with what gives that sign; the other is empty.
struct ChosenInsideTest {
  InsideTestChoice choice;
  Inside inside = {};
  Pseudonormals normals = {};
};

/// Which sign suits a mesh: the pseudonormal's where it is certain to be that of the winding number, which is cheaper
/// to trust than to ask.
///
/// It is certain (Bærentzen & Aanæs 2005) of a mesh that has no rim and does not meet itself, nor come so near itself
/// that distances round to the same, if every piece of its surface has the outside before it and the inside behind it,
/// and no edge or corner is so sharp that its pseudonormal is rounding. Pieces are what hangs together by edges of two
/// faces: along one of them neither changes.
///
/// Throws `Cancelled`.
ChosenInsideTest chooseInsideTest(const Hierarchy& hierarchy, const TriangleMesh& mesh, const Progress& progress);

}  // namespace hpsdf::distance
