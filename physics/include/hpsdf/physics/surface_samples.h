#pragma once
// Points of a body's surface at which the fields of other bodies are evaluated (Koschier et al. 2016, sec.
// 4, after Sanchez et al. 2012). They are stored in a hierarchy of bounding spheres.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "hpsdf/physics/sphere_tree.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf::physics {

constexpr std::size_t kMaxSamples = std::size_t{1} << 24;  ///< greatest number of samples; choosing so many takes 6 GB

/// Options of the sampling. Exactly one of `count` and `spacing` must be set.
struct SampleOptions {
  std::optional<std::size_t> count = {};
  /// The square root of the surface area per sample, in mesh units. The distance from a sample to its nearest neighbour
  /// is about 0.85 times this length.
  std::optional<double> spacing = {};
  std::uint64_t seed = 1;  ///< seed of the random candidates
};

/// Points of a surface with the outward normals of the surface. The points are sorted so that the points in each
/// bounding sphere are contiguous. The object is immutable.
class SurfaceSamples {
 public:
  /// Takes points with one unit normal each, and reorders them. Throws `Error` if there are no points or more
  /// than `kMaxSamples`, if the two spans have unequal lengths, or if coordinates are not finite.
  SurfaceSamples(std::span<const Vector3> points, std::span<const Vector3> normals);

  std::size_t size() const { return points_.size(); }
  std::span<const Vector3> points() const { return points_; }
  std::span<const Vector3> normals() const { return normals_; }
  std::span<const Sphere> spheres() const { return spheres_; }  ///< the first one contains all samples

 private:
  std::vector<Vector3> points_, normals_;
  std::vector<Sphere> spheres_;
};

/// Distributes samples evenly over a mesh by sample elimination (Yuksel 2015). Each sample has the normal
/// of its triangle. Sampling starts from five times as many random points as needed. Then the point with
/// the most and nearest neighbours is removed repeatedly until the required number is left. Surfaces that
/// face away from each other, like the two sides of a thin wall, are sampled independently. The same mesh
/// and options always give the same bytes.
///
/// Throws `Error` if the mesh has no triangles or no area, has indices out of range or coordinates that are not finite;
/// if `count` and `spacing` are both set or both unset; if the count is 0 or more than `kMaxSamples`; and if the
/// spacing is not finite or not above 0.
SurfaceSamples sampleSurface(const TriangleMesh& mesh, const SampleOptions& options);

}  // namespace hpsdf::physics
