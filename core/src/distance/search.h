#pragma once
// The part of a search that is vectorised: walking the hierarchy in float and collecting the triangles that may be the
// nearest. What is exact is done elsewhere, once for all instruction sets.

#include <array>
#include <cstdint>

#include "distance/hierarchy.h"

namespace hpsdf::distance {

/// `Lanes` points on their way through the hierarchy. Squares are of float distances in the hierarchy's coordinates.
template <int Lanes>
struct Search {
  static constexpr int kCapacity = 96;  ///< candidates between two settlements

  explicit Search(const Hierarchy& tree) : hierarchy(tree) {}

  /// Computes the distances to the candidates in double, keeps what is nearer, and empties the list.
  void settle();

  const Hierarchy& hierarchy;
  alignas(64) float point[3][Lanes];
  alignas(64) float limit[Lanes];  ///< squares above are out of reach
  float delta = 0;                 ///< bound of what rounding does to a distance
  int count = 0;
  std::array<std::uint32_t, kCapacity> candidates;  ///< slots
  alignas(64) float lower[kCapacity][Lanes];  ///< of each candidate: bound of its squared distance
  std::array<Vector3, Lanes> exactPoint;
  std::array<Nearest, Lanes> best;
};

extern template struct Search<1>;
extern template struct Search<kPacket>;

/// Walks the hierarchy by the best instruction set at hand; `best` is settled at the end.
void walk(Search<1>& search);
void walk(Search<kPacket>& search);

}  // namespace hpsdf::distance
