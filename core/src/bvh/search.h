#pragma once
// SIMD search for the nearest triangles. It traverses the hierarchy in single precision and collects candidate
// triangles that may be the nearest. It computes the distances to the candidates in double precision, with the
// same operations on every instruction set.

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "bvh/hierarchy.h"

namespace hpsdf::bvh {

/// State of a search that finds the nearest triangle of each of `Lanes` points, one point per SIMD lane. All members of
/// type `float` are in the local coordinates of the hierarchy.
template <int Lanes>
struct Search {
  static constexpr int kCapacity = 96;  ///< capacity of the list of candidates, which `settle` empties

  /// Begins the search for 1 to `Lanes` points. Lanes beyond them repeat the last point.
  Search(const Hierarchy& hierarchy, std::span<const Vector3> points);

  /// Makes the search visit the block of the triangle in this slot first. If the triangle is close to the query points,
  /// the search has a tight distance bound from the start.
  void addSeed(std::uint32_t triangleSlot);

  /// Makes the search leave out triangles of which the squared distances to all points are certainly above `within`,
  /// which has one entry for each point.
  void restrictTo(std::span<const double> within);

  /// Returns the triangle nearest to the point in this lane. Its slot is `Nearest::kNone` if the search is restricted
  /// and has found none. `run` must have finished.
  Nearest result(int lane) const;

  const Hierarchy& hierarchy;
  bool isRestricted = false;
  bool tooFar = false;  ///< a point is so far away that floats would overflow: all triangles are candidates

  alignas(64) float point[3][Lanes];      ///< the points in local coordinates
  alignas(64) float limit[Lanes];         ///< squared distance above which a triangle cannot be nearest
  float delta;                            ///< bound of the rounding error of a (not squared) distance
  int seeds = 0;                          ///< number of blocks in `seed`
  std::array<std::uint32_t, Lanes> seed;  ///< blocks of triangles to visit first, without repetition

  int count = 0;                                    ///< number of candidates
  std::array<std::uint32_t, kCapacity> candidates;  ///< slots of triangles
  alignas(64) float lower[kCapacity][Lanes];        ///< lower bounds of the candidates' squared distances

  // The query points, and for each point the nearest triangle found so far, in double precision and mesh units.
  alignas(64) double exact[3][Lanes];
  alignas(64) double squared[Lanes];
  alignas(64) double triangle[Lanes];  ///< index of the triangle in the mesh
  alignas(64) double slot[Lanes];
  alignas(64) double height[Lanes];
  alignas(64) double side[3][Lanes];
  alignas(64) double inside[Lanes];  ///< 1 if the point projects into the triangle, else 0
  alignas(64) double normal[3][Lanes];
  alignas(64) double length[Lanes];
  alignas(64) double firstCorner[Lanes];
};

extern template struct Search<1>;
extern template struct Search<kSmallPacket>;
extern template struct Search<kPacket>;

/// Runs the search with the best instruction set of this processor.
void run(Search<1>& search);
void run(Search<kSmallPacket>& search);
void run(Search<kPacket>& search);

/// Returns the triangle nearest to x.
Nearest nearestTriangle(const Hierarchy& hierarchy, const Vector3& x);

/// Returns the distance from x to the nearest triangle.
double distanceTo(const Hierarchy& hierarchy, const Vector3& x);

/// Finds the nearest triangle of each point of a packet, of 1 to kPacket points, in one search. The points should be
/// close to each other. On entry, `nearest` holds triangles from which the search starts, such as those found for
/// nearby points. On return, it holds the nearest triangles. Both spans must have the same length.
///
/// If `within` is not empty, it holds for each point the greatest squared distance at which a triangle matters. Where
/// all triangles are farther away, the search may return any triangle, or the slot `Nearest::kNone`.
void nearestTriangles(const Hierarchy& hierarchy, std::span<const Vector3> points, std::span<Nearest> nearest,
                      std::span<const double> within = {});

/// Returns the name of the SIMD instruction set in use, such as "AVX2".
std::string_view instructionSet();

}  // namespace hpsdf::bvh
