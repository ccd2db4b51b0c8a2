#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

namespace hpsdf::mesh {

/// Some triangles in single precision, relative to a point, and lower bounds of their distances from this point.
struct TriangleChunk {
  static constexpr std::size_t kSize = 128;
  static constexpr std::size_t kMostLanes = 16;  ///< triangles in a SIMD vector of the widest instruction set

  std::size_t count = 0;
  /// The corners A, B and C of each triangle, minus the point: corners[corner][axis][triangle].
  alignas(64) std::array<std::array<std::array<float, kSize>, 3>, 3> corners;
  alignas(64) std::array<float, kSize> lower;  ///< lower bound of the distance; NaN for a triangle without area

  /// Sets the corner of a triangle.
  void setCorner(int corner, std::size_t triangle, const Eigen::Vector3f& to) {
    for (int axis = 0; axis < 3; ++axis) corners[corner][axis][triangle] = to[axis];
  }
};

/// Fills the corners behind the last triangle with copies of it, up to a multiple of `kMostLanes`. To be called when
/// the corners of a chunk have been set singly, before their bounds are found.
void fillLastVector(TriangleChunk& chunk);

/// Computes lower bounds of the distances from the point to the triangles. Returns an upper bound of the distance to
/// the nearest of the triangles with area, or infinity if there is none. The bounds allow for rounding in this function
/// and of the corners, relative to their distances from the point. `count` must be above 0.
float findBounds(TriangleChunk& chunk);

/// Computes the bounds of the distances from another point, which is given relative to the first one. The bounds also
/// allow for rounding of the corners relative to the first point.
float findBounds(TriangleChunk& chunk, const Eigen::Vector3f& point);

}  // namespace hpsdf::mesh
