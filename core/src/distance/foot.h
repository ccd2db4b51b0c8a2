#pragma once

#include <cstdint>

#include "bvh/hierarchy.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"
#include "sign/pseudonormals.h"

namespace hpsdf::distance {

/// The closest point on the nearest triangle.
struct Foot {
  Vector3 point;
  double signedDistance;
  std::uint32_t slot;  ///< the triangle, in the order of its hierarchy
  Feature feature;
  std::uint8_t index = 0;  ///< as in `ClosestPoint::featureIndex`
  double along = 0;        ///< on an edge, the weight of its second end
};

/// Returns the closest point on the nearest triangle. The point is computed from the vertices of the mesh, so that a
/// query point on a vertex has distance 0. The distance has the sign of the pseudonormal, where `normals` is not null.
Foot footOf(const bvh::Hierarchy& triangles, const sign::Pseudonormals* normals, const Vector3& x,
            const bvh::Nearest& nearest);

/// Returns the unit vector from the closest point on the nearest triangle to x. If x is so close to the triangle that
/// rounding decides about this direction, returns the triangle's normal, on the side of x.
Vector3 directionFrom(const Foot& closest, const Vector3& x, const bvh::Nearest& nearest);

}  // namespace hpsdf::distance
