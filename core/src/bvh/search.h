#pragma once
// A search for nearest triangles, vectorised: it walks the hierarchy in float, collects the triangles that may be the
// nearest, and measures those in double, in the same operations on every instruction set.

#include <array>
#include <cstdint>
#include <string_view>

#include "bvh/hierarchy.h"

namespace hpsdf::distance {

/// `Lanes` points on their way through the hierarchy. Squares of float are of distances in the hierarchy's coordinates.
template <int Lanes>
struct Search {
  static constexpr int kCapacity = 96;  ///< candidates between two settlements

  Search(const Hierarchy& hierarchy, const std::array<Vector3, Lanes>& points);

  /// A place whose block, probably near, is to be visited first.
  void addSeed(std::uint32_t near);

  /// Lane by lane: the nearest triangle.
  Nearest result(int lane) const;

  const Hierarchy& hierarchy;
  bool tooFar = false;  ///< float coordinates or their squares would overflow: all triangles are tried

  alignas(64) float point[3][Lanes];
  alignas(64) float limit[Lanes];  ///< squares above are out of reach
  float delta;                     ///< bounds what rounding does to a distance
  int seeds = 0;
  std::array<std::uint32_t, Lanes> seed;  ///< blocks to visit first, once each

  int count = 0;
  std::array<std::uint32_t, kCapacity> candidates;  ///< places
  alignas(64) float lower[kCapacity][Lanes];        ///< of each candidate: bound of its squared distance

  // in double: the points, and what is best among the candidates settled so far
  alignas(64) double exact[3][Lanes];
  alignas(64) double squared[Lanes];
  alignas(64) double triangle[Lanes];  ///< index in the mesh
  alignas(64) double place[Lanes];
  alignas(64) double height[Lanes];
  alignas(64) double side[3][Lanes];
  alignas(64) double inside[Lanes];  ///< 1 or 0
};

extern template struct Search<1>;
extern template struct Search<kPacket>;

/// Runs the search by the best instruction set at hand.
void run(Search<1>& search);
void run(Search<kPacket>& search);

/// The triangle nearest to x.
Nearest nearestTriangle(const Hierarchy& hierarchy, const Vector3& x);

/// The same for `kPacket` points that lie close together, by one search. `nearest` on entry: triangles to start from,
/// such as the results for points nearby.
void nearestTriangles(const Hierarchy& hierarchy, const std::array<Vector3, kPacket>& points,
                      std::array<Nearest, kPacket>& nearest);

/// The one in use, such as "AVX2".
std::string_view instructionSet();

}  // namespace hpsdf::distance
