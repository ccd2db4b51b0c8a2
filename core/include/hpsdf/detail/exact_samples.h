#pragma once
// Random points with their exact distances.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// Points with their exact distances. Points that follow each other in the list are close to each other in space.
struct ExactSamples {
  std::vector<Vector3> points;
  std::vector<double> distances;  ///< Φ at the points, negative inside
};

/// Options of random points. The points depend on the seed, not on the number of threads.
struct SampleOptions {
  std::size_t count = 500'000;
  std::uint64_t seed = 1;
  int threads = 0;  ///< greatest number of threads; 0: all that the machine offers
};

/// Draws points uniformly from the domain or, if `band` is above 0, from the part of the domain where |Φ| ≤ band.
/// Throws `Error` if no such part is found or Φ is not finite, `Cancelled` when `progress` says so.
ExactSamples sampleUniform(const DistanceFunction& distance, const Box& domain, double band = 0,
                           const SampleOptions& options = {}, const Progress& progress = {});

/// Draws points near a surface: points that are uniform on the surface, moved by vectors that are uniform in a ball of
/// `radius` (above 0). Points outside the domain are drawn again. Throws `Error` if hardly any point lies in the
/// domain, if the surface has no area or Φ is not finite, `Cancelled` when `progress` says so.
ExactSamples sampleNear(const DistanceFunction& distance, const TriangleMesh& surface, const Box& domain, double radius,
                        const SampleOptions& options = {}, const Progress& progress = {});

}  // namespace hpsdf
