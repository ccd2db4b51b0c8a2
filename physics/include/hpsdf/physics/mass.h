#pragma once
// Mass, centre of mass and moments of inertia of a closed mesh.

#include <Eigen/Geometry>

#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf::physics {

/// The mass properties of a body of uniform density. Lengths are in the units of the body's mesh.
struct MassProperties {
  double volume;  ///< above 0
  /// Maps the frame of inertia to the mesh. The origin of the frame of inertia is the centre of mass, its
  /// axes are the principal axes.
  Eigen::Isometry3d meshFromInertia;
  Vector3 inertia;  ///< principal moments of inertia for mass 1, in squared units of length
  Box box;          ///< bounding box of the mesh in the frame of inertia
};

/// Computes the mass properties of a closed mesh. Integrates over the tetrahedra that the faces form with one common
/// point (divergence theorem; Tonon 2004 gives the moments of a tetrahedron). Throws `Error` if the mesh has no volume,
/// has indices out of range, or has coordinates that are not finite. For an open mesh, the result is that of the mesh
/// whose holes are closed by triangles to the common point.
MassProperties massProperties(const TriangleMesh& mesh);

}  // namespace hpsdf::physics
