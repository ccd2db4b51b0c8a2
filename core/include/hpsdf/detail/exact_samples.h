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

/// Points and Φ there. Neighbours in the list are neighbours in space.
struct ExactSamples {
  std::vector<Vector3> points;
  std::vector<double> distances;  ///< Φ, negative inside
};

/// How points are drawn. The same seed gives the same points, whatever the number of threads.
struct SampleOptions {
  std::size_t count = 500'000;
  std::uint64_t seed = 1;
  int threads = 0;  ///< at most; 0: all that the machine offers
};

/// Points that are uniform in the domain, or, with a `band` above 0, in the part of it where |Φ| is at most that.
/// Throws `Error` where no such part was found, or for a Φ that is not finite; `Cancelled` when progress says so.
ExactSamples sampleUniform(const DistanceFunction& distance, const Box& domain, double band = 0,
                           const SampleOptions& options = {}, const Progress& progress = {});

/// Points near a surface: one at random on it, uniform by area, moved by a vector that is uniform in the ball of
/// `radius` (above 0). Those outside the domain are drawn anew; throws `Error` when there are hardly any others, for a
/// surface without area, or for a Φ that is not finite; `Cancelled` when progress says so.
ExactSamples sampleNear(const DistanceFunction& distance, const TriangleMesh& surface, const Box& domain, double radius,
                        const SampleOptions& options = {}, const Progress& progress = {});

}  // namespace hpsdf
