#pragma once
// What a rigid body of a closed surface weighs, and how it turns.

#include <Eigen/Geometry>

#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf::physics {

/// Of a body of even density, in its mesh's units.
struct MassProperties {
  double volume;                      ///< above 0
  Eigen::Isometry3d meshFromInertia;  ///< from the frame whose origin is the centre of mass, along the principal axes
  Vector3 inertia;                    ///< about these axes, of a body of mass 1: squared mesh units
  Box box;                            ///< of the mesh, in that frame
};

/// By the divergence theorem, over the tetrahedra of the faces and the origin (Tonon 2004 gives their moments). Throws
/// `Error` for a mesh without volume, with indices out of range or coordinates that are not finite; one that is open
/// gives the figures of some closed one.
MassProperties massProperties(const TriangleMesh& mesh);

}  // namespace hpsdf::physics
