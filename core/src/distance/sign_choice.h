#pragma once

#include <functional>
#include <span>
#include <vector>

#include "distance/inside.h"
#include "distance/pseudonormals.h"
#include "hpsdf/exact_distance.h"

namespace hpsdf::distance {

/// Many distances at once, signed by pseudonormals.
using SignedByNormals = std::function<void(std::span<const Vector3>, std::span<double>)>;

/// Which sign suits a mesh: the pseudonormal's, if the mesh is closed and the winding number says the same on a lattice
/// and on both sides of some triangles, those first at whose corners the surface is bent most.
SignChoice chooseSign(const Hierarchy& hierarchy, const Pseudonormals& normals, const Box& box, const Inside& inside,
                      const SignedByNormals& distances);

}  // namespace hpsdf::distance
