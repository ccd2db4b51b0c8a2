#pragma once

#include <cstddef>
#include <cstdint>

#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// The generalised winding number of a mesh around a point, above ½ inside: a whole number where the mesh is closed
/// (Jacobson et al. 2013). The sum over all triangles, 15 ns each, for comparisons; `ExactDistance` asks clusters.
double windingNumber(const TriangleMesh& mesh, const Vector3& x);

struct SignCheck {
  std::size_t places = 0;
  std::size_t tooNear = 0;  ///< of these: within `nearest` of the surface, where rounding decides
  double nearest = 0;       ///< 1e-6 of the mesh's longest side
  std::size_t wrong = 0;    ///< of the others: the distance's sign is not the winding number's
  Vector3 worst = Vector3::Zero();
  double depth = 0;  ///< the distance there, of the wrong ones' the greatest
};

/// Compares a distance's sign with the winding number by brute force: at random places, half of them in the mesh's box
/// and a tenth of its size around it, half beside its triangles, up to a hundredth of its size away. Takes places times
/// triangles times 15 ns, on all threads; the same for any number of these. `distance`: of this mesh. Throws
/// `Cancelled`.
SignCheck checkSign(const TriangleMesh& mesh, const ExactDistance& distance, std::size_t places, std::uint64_t seed = 1,
                    const Progress& progress = {});

}  // namespace hpsdf
