#pragma once
// Jumps of a field: the differences between neighbouring leaves on the faces that these leaves share.

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// The size of a field's jump on an interface between two leaves. At a point of the interface, the jump is the
/// difference between the field's limits from the two leaves.
struct Jump {
  /// √(∫ jump² dA / area) by a quadrature that is exact for polynomials. At exact leaves, it is approximate.
  double rms = 0;
  double max = 0;  ///< greatest jump at the quadrature points, including points on the face's edges and corners
};

/// The face that two neighbouring leaves share. If the leaves differ in size, it is a whole face of the smaller leaf.
struct Interface {
  std::array<std::uint32_t, 2> cells;   ///< `Cell::id` of the leaf on the lower and of the leaf on the upper side
  std::array<std::uint8_t, 2> degrees;  ///< `kExactDegree` for an exact leaf
  std::array<std::uint8_t, 2> depths;
  int axis;        ///< axis that is normal to the face: 0, 1 or 2
  Jump value;      ///< jump of f in units of length
  Jump gradient;   ///< length of the jump of ∇f
  double area;     ///< area of the face in units²
  Vector3 center;  ///< centre of the face
  Vector3 worst;   ///< point of the face where f jumps most

  /// Tells whether the two leaves differ in size, so that corners of the smaller leaf are hanging nodes on the
  /// larger leaf's face.
  bool hanging() const { return depths[0] != depths[1]; }
};

/// The jumps of a field over all interfaces between its leaves.
struct JumpTotals {
  std::size_t hanging = 0;  ///< number of interfaces between leaves of different size
  double area = 0;          ///< total area of the interfaces in units²
  Jump value;               ///< jumps of f over all interfaces
  Jump gradient;            ///< jumps of ∇f over all interfaces
};

/// All interfaces of a field, with their jumps.
struct Jumps : JumpTotals {
  std::vector<Interface> interfaces;  ///< in octree order of the smaller leaf, or of the lower leaf if equal in size
};

/// Measures the jumps of a field on all interfaces between its leaves. The result does not depend on `threads`
/// (0: all that the machine offers). Throws `Cancelled` when `progress` says so.
Jumps findJumps(const Field& field, int threads = 0, const Progress& progress = {});

/// Returns the totals of `findJumps`, to the bit, without the memory for all interfaces, some 300 bytes for each leaf.
JumpTotals measureJumps(const Field& field, int threads = 0, const Progress& progress = {});

enum class JumpKind : std::uint8_t { value, gradient };

inline const Jump& jumpOf(const Interface& interface, JumpKind kind) {
  return kind == JumpKind::value ? interface.value : interface.gradient;
}

/// Returns the indices of the `count` interfaces with the greatest maximum jump (`Jump::max`), greatest first.
/// Interfaces with equal jumps keep their order.
std::vector<std::size_t> worstInterfaces(const Jumps& jumps, JumpKind kind, std::size_t count);

/// Returns one number for each node of the octree (indexed by `Cell::id`): for a leaf, the greatest `Jump::max` on its
/// interfaces; 0 for internal nodes and for leaves without an interface.
std::vector<double> worstJumpOfCells(const Field& field, const Jumps& jumps, JumpKind kind);

/// One bin of a histogram of interfaces.
struct JumpBin {
  std::size_t interfaces = 0;
  double area = 0;  ///< in units²
};

/// Counts interfaces by the order of magnitude of their jumps: bin n holds the interfaces whose maximum jump is
/// in [10^n, 10^(n+1)). Interfaces without a jump are left out.
std::map<int, JumpBin> jumpHistogram(const Jumps& jumps, JumpKind kind);

}  // namespace hpsdf
