#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

namespace hpsdf::mesh {

/// Some triangles in single precision, relative to a point, and bounds of their distances from this point.
struct TriangleChunk {
  static constexpr std::size_t kSize = 128;

  std::size_t count = 0;
  /// The corners A, B and C of each triangle, minus the point. The fourth coordinates do not matter.
  alignas(64) std::array<std::array<Eigen::Vector4f, kSize>, 3> corners;
  alignas(64) std::array<float, kSize> lower;  ///< lower bound of the distance; NaN for a triangle without area
  alignas(64) std::array<float, kSize> upper;  ///< upper bound of the distance; NaN for a triangle without area
};

/// Fills the corners behind the last triangle with copies of it, up to the end of a SIMD vector of the widest
/// instruction set. To be called when the triangles of a chunk have changed, before their bounds are found.
void fillLastVector(TriangleChunk& chunk);

/// Computes the bounds of the distances from the point to the triangles. The bounds allow for rounding in this function
/// and of the corners, relative to their distances from the point. `count` must be above 0.
void findBounds(TriangleChunk& chunk);

/// Computes the bounds of the distances from another point, which is given relative to the first one. The bounds also
/// allow for rounding of the corners relative to the first point.
void findBounds(TriangleChunk& chunk, const Eigen::Vector3f& point);

}  // namespace hpsdf::mesh
