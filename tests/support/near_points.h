#pragma once

#include <cstddef>
#include <vector>

#include "hpsdf/detail/random_points.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"
#include "mesh/area_points.h"

namespace hpsdf::support {

/// Returns points within `reach` of the surface, uniformly distributed in surface area and in height.
inline std::vector<Vector3> pointsNear(const TriangleMesh& mesh, std::size_t count, double reach) {
  const mesh::AreaPoints surface(mesh);
  std::vector<Vector3> points(count);
  for (std::size_t n = 0; n < count; ++n) {
    detail::Random random(2016, n);
    points[n] = surface.drawWithin(reach, random);
  }
  return points;
}

}  // namespace hpsdf::support
