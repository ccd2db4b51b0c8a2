#pragma once
// The points of a body's surface that are evaluated in the fields of other bodies (Koschier et al. 2016, sec. 4, after
// Sanchez et al. 2012), in a hierarchy of bounding spheres.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "hpsdf/physics/sphere_tree.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf::physics {

constexpr std::size_t kMaxSamples = std::size_t{1} << 24;  ///< greatest number of samples; choosing them takes 6 GB

/// The number of samples, by exactly one of `count` and `spacing`.
struct SampleOptions {
  std::optional<std::size_t> count = {};
  /// Side in mesh units of the square of surface that each sample represents. The nearest neighbour of a sample is
  /// about 0.85 times as far away.
  std::optional<double> spacing = {};
  std::uint64_t seed = 1;  ///< seed of the random candidates
};

/// Points of a surface with its outward normals, sorted so that the points of each sphere are contiguous. Immutable.
class SurfaceSamples {
 public:
  /// Takes points with one unit normal each, and reorders them. Throws `Error` for no points, for more than
  /// `kMaxSamples`, for spans of unequal length and for coordinates that are not finite.
  SurfaceSamples(std::span<const Vector3> points, std::span<const Vector3> normals);

  std::size_t size() const { return points_.size(); }
  std::span<const Vector3> points() const { return points_; }
  std::span<const Vector3> normals() const { return normals_; }
  std::span<const Sphere> spheres() const { return spheres_; }  ///< the first one contains all samples

 private:
  std::vector<Vector3> points_, normals_;
  std::vector<Sphere> spheres_;
};

/// Distributes samples evenly over a mesh, with the normals of their triangles, by sample elimination (Yuksel
/// 2015). It starts from five times as many random points and removes the point with the most and nearest
/// neighbours until the number is right. Surfaces that face away from each other, like the two sides of a thin
/// wall, are sampled independently. The same mesh and options give the same bytes.
///
/// Throws `Error` for a mesh without triangles or area, with indices out of range or coordinates that are not
/// finite, for options that do not have exactly one of count and spacing, for a count of 0 or beyond
/// `kMaxSamples`, and for a spacing that is not above 0 or not finite.
SurfaceSamples sampleSurface(const TriangleMesh& mesh, const SampleOptions& options);

}  // namespace hpsdf::physics
