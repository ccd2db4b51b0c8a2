#pragma once
// Mass, centre of mass and moments of inertia of a closed mesh.

#include <Eigen/Geometry>

#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf::physics {

/// Properties of a body of uniform density, in its mesh's units.
struct MassProperties {
  double volume;  ///< above 0
  /// From the frame of inertia, whose origin is the centre of mass and whose axes are the principal axes.
  Eigen::Isometry3d meshFromInertia;
  Vector3 inertia;  ///< moments about the principal axes of a body of mass 1, in squared units
  Box box;          ///< bounding box of the mesh in the frame of inertia
};

/// Integrates over the tetrahedra that the faces form with one point (divergence theorem; Tonon 2004 gives their
/// moments). Throws `Error` for a mesh without volume, with indices out of range or coordinates that are not
/// finite. For an open mesh the result is that of some closed mesh.
MassProperties massProperties(const TriangleMesh& mesh);

}  // namespace hpsdf::physics
