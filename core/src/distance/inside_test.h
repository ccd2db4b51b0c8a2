#pragma once

#include "bvh/hierarchy.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"
#include "sign/pseudonormals.h"
#include "sign/winding_sign.h"

namespace hpsdf::distance {

/// A choice of inside test with the data that it needs; the data of the other test are empty.
struct ChosenInsideTest {
  InsideTestChoice choice;
  sign::WindingSign winding = {};
  sign::Pseudonormals normals = {};
};

/// Chooses pseudonormals where their sign is certain to be that of the winding number, which is more expensive.
///
/// It is certain (Bærentzen & Aanæs 2005) if
/// * every edge is balanced, so that the mesh has no holes;
/// * the mesh neither intersects itself nor comes so near itself that distances to two triangles may round to the same;
/// * each component, connected by edges of two consistent triangles, has the outside in front and the inside behind it,
///   which one triangle tells for all of it;
/// * no edge or vertex is so sharp that its pseudonormal is dominated by rounding errors.
///
/// Throws `Cancelled`.
ChosenInsideTest chooseInsideTest(const bvh::Hierarchy& hierarchy, const TriangleMesh& mesh, const Progress& progress);

}  // namespace hpsdf::distance
