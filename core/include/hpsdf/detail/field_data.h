#pragma once
// A field's arrays, and how it came to be.

#include <array>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "hpsdf/build_options.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// How a field came to be: stored with it, shown by `info`. Distances are in mesh units unless said.
struct FieldMetadata {
  Source source;
  double targetError = 0;      ///< τ at the paper's scale (longest side 2)
  double totalError = 0;       ///< ε, weighted by nearness, at the paper's scale: comparable with targetError
  double referenceLength = 2;  ///< L: an error at the paper's scale times (L/2)^5 is one in the field's own units^5
  double nearness = 0;         ///< θ
  std::uint32_t maxDegree = 0;
  std::uint32_t maxDepth = 0;
  std::uint32_t quadrature = 0;  ///< order as a multiple of the degree
  Strategy strategy = Strategy::hp;
  double band = 0;                     ///< width of the narrow band, 0 for none
  std::uint64_t exactEvaluations = 0;  ///< of Φ during the construction
  /// Leaves that the construction raised or split; nothing where that is not known, as of files of version 1.
  std::optional<std::uint64_t> steps = {};
  double roundingRms = 0;  ///< RMS change of the field by keeping its coefficients as float; 0 for double
  Estimator estimator = Estimator::embedded;
  Criterion criterion = Criterion::paper;
  NearnessKind nearnessKind = NearnessKind::polynomial;
  double maxError = 0;  ///< |f − Φ| that no place looked at was to exceed, in the field's units; 0: not asked for
  /// The greatest at those places, of the leaves' own polynomials, where it was asked for, and what rounding
  /// may add where that is more than a hundredth of `maxError`.
  double measuredError = 0;
  bool enriched = false;        ///< every cell was fitted anew, one degree higher, at the end
  double continuityWeight = 0;  ///< λ of weak continuity, see `continuity.h`; 0: the cells' own fits

  /// √(ε/|Ω|) in the field's own units: the estimated RMS error that the construction ended with.
  double rmsEstimate(const Box& domain) const;
};

/// What holds throughout a leaf, whatever lies between samples. See `safe_distance.h`.
struct CellBound {
  float error = 0;  ///< |f − Φ| at most, in the field's units
  float slope = 0;  ///< ‖∇f‖ at most
};

/// The finished octree as arrays. The first `grid.prod()` nodes are the base cells, x fastest, then y, then z. A node
/// is
///   internal: bit 63 clear, low 32 bits the index of the first of its 8 children (child number = x + 2y + 4z);
///   leaf:     bit 63 set, bits 32..39 the degree p, low 32 bits the offset of its n(p) coefficients.
/// All other bits are 0.
/// Coefficients c_ijk of a cell stand in lexicographic order of (i, j, k), i+j+k ≤ p, k fastest; they multiply plain
/// Legendre polynomials L_i(u) L_j(v) L_k(w), local coordinates in [-1, 1], so that they are in units of length.
struct FieldData {
  Box domain;
  std::array<std::uint32_t, 3> grid = {1, 1, 1};  ///< base cells an axis
  std::vector<std::uint64_t> nodes;
  std::variant<std::vector<double>, std::vector<float>> coefficients;
  /// Width of the zone along a leaf's faces, as a part of its edges, in which it is blended with its neighbours, so
  /// that the field and its gradient are continuous; 0 to `kMaxBlend`. 0: leaves answer alone, and the field jumps.
  double blend = 0;
  std::vector<CellBound> bounds = {};  ///< by node, those of internal nodes 0; empty where they are not kept
  FieldMetadata metadata = {};
};

/// A node's bits, in one place.
namespace node {
constexpr std::uint64_t kLeafBit = std::uint64_t{1} << 63;
constexpr bool isLeaf(std::uint64_t n) { return (n & kLeafBit) != 0; }
constexpr std::uint32_t firstChild(std::uint64_t n) { return static_cast<std::uint32_t>(n); }
constexpr std::uint32_t offset(std::uint64_t n) { return static_cast<std::uint32_t>(n); }
constexpr int degree(std::uint64_t n) { return static_cast<int>((n >> 32) & 0xff); }
constexpr std::uint64_t leaf(int degree, std::uint32_t offset) {
  return kLeafBit | (std::uint64_t(degree) << 32) | offset;
}
constexpr bool hasOnlyKnownBits(std::uint64_t n) {
  return (n & ~(isLeaf(n) ? leaf(0xff, 0xffffffff) : 0xffffffff)) == 0;
}
constexpr std::uint64_t internal(std::uint32_t firstChild) { return firstChild; }
}  // namespace node

/// How far a leaf of a blended field goes beyond its sides, and as far within them its say grows to the whole: by so
/// much of an edge of a cell of a certain depth as `FieldData::blend` says. The depth is that of the deepest leaf that
/// touches the side, itself included, or `kWall` where the domain ends; 5 bits each.
namespace blend_extent {
constexpr int kWall = 31;
constexpr std::uint32_t packed(int axis, bool upper, int depth) {
  return std::uint32_t(depth) << (10 * axis + (upper ? 5 : 0));
}
constexpr int depth(std::uint32_t reach, int axis, bool upper) {
  return static_cast<int>(reach >> (10 * axis + (upper ? 5 : 0)) & 31);
}
}  // namespace blend_extent

/// A leaf of the octree.
struct Cell {
  std::uint32_t id;  ///< its node's index: names the cell within its field
  Box box;           ///< half-open but for rounding: [min, max)
  int degree;
  int depth;     ///< 0 for a base cell
  double error;  ///< ε_e: squared error that the top degree stands for, in units^5, without nearness (paper, eq. 6)
};

struct ValueAndGradient {
  double value;
  Vector3 gradient;
};

}  // namespace hpsdf
