#pragma once
// Random points with the exact distances at these points.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// Points and their exact distances from a surface. Successive points in the list are close to each other in
/// space.
struct ExactSamples {
  std::vector<Vector3> points;
  std::vector<double> distances;  ///< Φ at the points, negative inside
};

/// Options for drawing random points. The points depend on the seed, not on the number of threads.
struct SampleOptions {
  std::size_t count = 500'000;
  std::uint64_t seed = 1;
  int threads = 0;  ///< greatest number of threads; 0: all that the machine offers
  /// A point for which this returns false is drawn again, before Φ is evaluated there. If it is empty, all are taken.
  std::function<bool(const Vector3&)> where = {};
};

/// Thrown where hardly any point of the domain is as close to the surface as asked.
class NoSamplesError : public Error {
 public:
  using Error::Error;
};

/// Draws random points and evaluates the signed distance Φ (`distance`) at them. The points are uniform in the domain
/// or, if `band` is above 0, in the part of the domain where |Φ| ≤ `band`. Throws `NoSamplesError` if no such point is
/// found, and `Error` if Φ is not finite. Throws `Cancelled` when `progress` says so.
ExactSamples sampleUniform(const DistanceFunction& distance, const Box& domain, double band = 0,
                           const SampleOptions& options = {}, const Progress& progress = {});

/// Draws random points of a surface, uniformly by area. Points outside the domain are left out. Throws `Error` if the
/// surface has no area.
std::vector<Vector3> sampleSurface(const TriangleMesh& surface, const Box& domain, const SampleOptions& options = {});

/// Draws random points near a surface and evaluates the signed distance Φ (`distance`) at them. Each point is a
/// uniformly distributed point of the surface plus a vector that is uniformly distributed in a ball of `radius` (above
/// 0). A point outside the domain is drawn again. Throws `NoSamplesError` if hardly any point lies in the domain, and
/// `Error` if the surface has no area or if Φ is not finite. Throws `Cancelled` when `progress` says so.
ExactSamples sampleNear(const DistanceFunction& distance, const TriangleMesh& surface, const Box& domain, double radius,
                        const SampleOptions& options = {}, const Progress& progress = {});

}  // namespace hpsdf
