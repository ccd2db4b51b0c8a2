#pragma once

#include <cstddef>
#include <cstdint>

#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// Returns the generalised winding number of a mesh about the point x (Jacobson et al. 2013). It is above ½ if x is
/// inside, and a whole number if the mesh is closed. This function sums over all triangles, which takes 15 ns per
/// triangle. The faster sum over clusters of triangles in `ExactDistance` is checked against this function.
double windingNumber(const TriangleMesh& mesh, const Vector3& x);

/// The result of `checkSign`, which compares signs at `points` random points.
struct SignCheck {
  std::size_t points = 0;
  std::size_t tooNear = 0;          ///< points within `tolerance` of the surface, which are not compared
  double tolerance = 0;             ///< 1e-6 times the longest side of the mesh's box
  std::size_t wrong = 0;            ///< points at which the sign of the distance contradicts the winding number
  Vector3 worst = Vector3::Zero();  ///< the wrong point that is farthest from the surface
  double worstDistance = 0;         ///< distance of `worst` from the surface, 0 or more
};

/// Compares the signs of `distance` at random points with the winding number of `mesh`, summed over all triangles. Half
/// of the points are uniform in the mesh's bounding box, enlarged on all sides by a tenth of its longest side. The
/// other points lie within a hundredth of the enlarged box's longest side of random points on triangles. On one thread,
/// n points and m triangles take n·m·15 ns. The check uses all threads; their number does not change the result. Throws
/// `Cancelled` when `progress` says so.
SignCheck checkSign(const TriangleMesh& mesh, const ExactDistance& distance, std::size_t points, std::uint64_t seed = 1,
                    const Progress& progress = {});

}  // namespace hpsdf
