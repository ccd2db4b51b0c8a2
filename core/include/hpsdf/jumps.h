#pragma once
// Where the field is not continuous: its leaves meet at faces without matching there.

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// How far the limits from two leaves are apart on their face: those of their polynomials or, of a blended field, of
/// what queries answer just within either.
struct Jump {
  double rms = 0;  ///< √(∫ jump² dA / area), by a quadrature that is exact for polynomials
  double max = 0;  ///< greatest at the quadrature's points, along the face's edges and at its corners
};

/// Where two leaves meet: a whole face of the smaller one; if they are of one size, of both.
struct Interface {
  std::array<std::uint32_t, 2> cells;  ///< `Cell::id` on the side of smaller and of greater coordinates
  std::array<std::uint8_t, 2> degrees;
  std::array<std::uint8_t, 2> depths;
  int axis;        ///< 0, 1, 2: across the face
  Jump value;      ///< of f, in the field's units
  Jump gradient;   ///< length of the difference of the gradients
  double area;     ///< in the field's units²
  Vector3 center;  ///< of the face
  Vector3 worst;   ///< where f jumps most

  bool hanging() const { return depths[0] != depths[1]; }
};

/// All of a field's interfaces.
struct Jumps {
  std::vector<Interface> interfaces;  ///< in the order of the smaller (or lower) cells within the octree
  std::size_t hanging = 0;            ///< between cells of different size
  double area = 0;                    ///< of all faces
  Jump value;                         ///< over all faces: RMS by area, and the greatest
  Jump gradient;
};

/// Measures every interface. The result does not depend on `threads` (0: all that the machine offers).
/// Throws `Cancelled` when progress says so.
Jumps findJumps(const Field& field, int threads = 0, const Progress& progress = {});

enum class JumpKind : std::uint8_t { value, gradient };

inline const Jump& jumpOf(const Interface& interface, JumpKind kind) {
  return kind == JumpKind::value ? interface.value : interface.gradient;
}

/// Indices of the `count` interfaces with the greatest `max`, worst first; of equal ones the earlier.
std::vector<std::size_t> worstInterfaces(const Jumps& jumps, JumpKind kind, std::size_t count);

/// By `Cell::id`: the greatest `max` among the leaf's interfaces; 0 for a leaf without and for an internal node.
std::vector<double> worstJumpOfCells(const Field& field, const Jumps& jumps, JumpKind kind);

/// A share of a histogram.
struct JumpBin {
  std::size_t interfaces = 0;
  double area = 0;
};

/// By the power of ten: bin n holds interfaces whose `max` lies in [10^n, 10^(n+1)). Those without a jump are left out.
std::map<int, JumpBin> jumpHistogram(const Jumps& jumps, JumpKind kind);

}  // namespace hpsdf
