#pragma once
// The points of a body's surface that are looked up in the fields of other bodies (paper, sec. 4, after Sanchez et al.
// 2012), in a hierarchy of bounding spheres.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf::physics {

constexpr std::size_t kMaxSamples = std::size_t{1} << 24;  ///< a body may have; choosing them takes some 6 GB

/// How many samples, by one of the first two.
struct SampleOptions {
  std::optional<std::size_t> count = {};
  /// In mesh units: a sample for each square of this side, so that the nearest neighbour is some 0.85 of it away.
  std::optional<double> spacing = {};
  std::uint64_t seed = 1;
};

/// A node of the hierarchy: holds the samples `begin` to `end`. Those of its subtree follow it in the order of depth
/// first, and `next` is the first node behind them: where to go on when a sphere is passed over. Without children
/// `next` is the node right behind.
struct Sphere {
  Vector3 center;
  double radius;  ///< no sample is farther from the centre, whatever was rounded
  std::uint32_t begin, end;
  std::uint32_t next;
};

/// Points of a surface with its outward normals, sorted so that each node's are contiguous. Immutable.
class SurfaceSamples {
 public:
  /// Any points, and unit normals, one each; they are put into another order. Throws `Error` for none, for more than
  /// `kMaxSamples`, for spans of unequal length and for what is not finite.
  SurfaceSamples(std::span<const Vector3> points, std::span<const Vector3> normals);

  std::size_t size() const { return points_.size(); }
  std::span<const Vector3> points() const { return points_; }
  std::span<const Vector3> normals() const { return normals_; }
  std::span<const Sphere> spheres() const { return spheres_; }  ///< the first one holds all samples

 private:
  std::vector<Vector3> points_, normals_;
  std::vector<Sphere> spheres_;
};

/// Even samples of a mesh with its triangles' normals: of five times as many random points those are left out, one by
/// one, that have the nearest neighbours (sample elimination, Yuksel 2015). Surfaces that face away from each other, as
/// the two sides of a thin wall, are sampled each by itself. The same mesh and options give the same bytes. Throws
/// `Error` for a mesh without triangles or area, with indices out of range or coordinates that are not finite, unless
/// just one of count and spacing is given, for a count of 0 and for one beyond `kMaxSamples`, for a spacing that is not
/// above 0 or not finite.
SurfaceSamples sampleSurface(const TriangleMesh& mesh, const SampleOptions& options);

}  // namespace hpsdf::physics
