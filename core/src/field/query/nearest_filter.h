#pragma once
// Quick choice of the triangles that can be nearest to a point.

#include <array>
#include <cstdint>
#include <span>

#include "hpsdf/detail/exact_triangles.h"
#include "hpsdf/types.h"
#include "mesh/triangle_bounds.h"

namespace hpsdf::query {

/// The triangles of a field, and the point relative to which their corners are loaded. `V` is a vector of floats or of
/// doubles.
template <typename V>
struct CornerSource {
  std::span<const std::array<std::uint32_t, 3>> triangles;
  std::span<const V> vertices;
  Vector3 origin;
};

/// The functions below may read and write so many numbers behind the last triangle.
inline constexpr std::uint32_t kFilterWidth = mesh::TriangleChunk::kMostLanes;
static_assert(kFilterWidth >= triangle_run::kMostLength);

/// A list of triangles, from a run on.
struct ListPart {
  const std::uint32_t* run;               ///< null at the end of the list
  std::span<const std::uint8_t> octants;  ///< begins with their octants, a byte each; what follows does not matter
};

/// Takes up to a chunk of triangles from a list, and keeps those that can be nearest to a point of the ball with this
/// radius around the origin, in this octant of a leaf. Returns their number. `nearest` is an upper bound of the
/// distance from the origin to the nearest triangle, and is lowered if one of these is nearer, unless there are so few
/// that they are not measured.
std::uint32_t keepNearest(const CornerSource<Eigen::Vector3f>& source, ListPart& rest, int octant, float radius,
                          std::uint32_t* triangles, float& nearest);
std::uint32_t keepNearest(const CornerSource<Eigen::Vector3d>& source, ListPart& rest, int octant, float radius,
                          std::uint32_t* triangles, float& nearest);

/// Sets the triangles of a chunk. `count` must be above 0.
void loadCorners(const CornerSource<Eigen::Vector3f>& source, std::uint32_t* triangles, std::uint32_t count,
                 mesh::TriangleChunk& chunk);
void loadCorners(const CornerSource<Eigen::Vector3d>& source, std::uint32_t* triangles, std::uint32_t count,
                 mesh::TriangleChunk& chunk);

}  // namespace hpsdf::query
