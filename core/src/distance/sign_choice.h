#pragma once

#include <utility>

#include "distance/inside.h"
#include "hpsdf/exact_distance.h"

namespace hpsdf::distance {

/// Which sign suits a mesh: the pseudonormal's where it is certain to be that of the winding number, which is cheaper
/// to trust than to ask; and what gives the sign, if it is not that.
///
/// It is certain (Bærentzen & Aanæs 2005) of a mesh that has no rim and does not meet itself, nor come so near itself
/// that distances round to the same, if every piece of its surface has the outside before it and the inside behind it.
/// Pieces are what hangs together by edges of two faces: along one of them neither changes.
std::pair<SignChoice, Inside> chooseSign(const Hierarchy& hierarchy, const TriangleMesh& mesh);

}  // namespace hpsdf::distance
