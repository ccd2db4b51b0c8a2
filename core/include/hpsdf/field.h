#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "hpsdf/distance_function.h"
#include "hpsdf/types.h"

namespace hpsdf {

constexpr int kMaxDegree = 30;
constexpr int kMaxDepth = 20;  ///< so that a cell's local coordinate keeps 32 bits of a double's 52

/// Of `FieldData::blend`: with more the zones at opposite faces of a cell could meet.
constexpr double kMaxBlend = 0.25;

/// n(p) = (p+1)(p+2)(p+3)/6: coefficients of a polynomial of total degree p (paper, sec. 3.3).
constexpr int coefficientCount(int degree) { return (degree + 1) * (degree + 2) * (degree + 3) / 6; }

enum class Strategy : std::uint8_t { hp, h1, h2 };

/// What stands for a cell's squared error, before nearness weighs it.
enum class Estimator : std::uint8_t {
  embedded,  ///< ε_e: what the top degree adds (paper, eq. 6)
  residual,  ///< ∫Φ² − ∫f²: what the fit leaves of the samples that it was made from
};

/// How degrees and depths of the leaves are chosen.
enum class Criterion : std::uint8_t {
  paper,    ///< the gain a coefficient (paper, eqs. 7 to 9)
  optimal,  ///< the paper's, somewhat beyond the target, and then back: what saves most bytes for its error is undone
};

/// κ(s) of the mean distance s, d being the domain's diagonal.
enum class NearnessKind : std::uint8_t {
  polynomial,   ///< (1 − s/d)^θ (paper, eq. 10)
  exponential,  ///< exp(−θ s/d) (Koschier et al. 2017)
};

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
namespace reach {
constexpr int kWall = 31;
constexpr std::uint32_t packed(int axis, bool upper, int depth) {
  return std::uint32_t(depth) << (10 * axis + (upper ? 5 : 0));
}
constexpr int depth(std::uint32_t reach, int axis, bool upper) {
  return static_cast<int>(reach >> (10 * axis + (upper ? 5 : 0)) & 31);
}
}  // namespace reach

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

/// The base grid as queries need it: numbers along x, y and z.
struct GridFrame {
  std::array<double, 3> lower, upper, size;  ///< of the domain
  std::array<double, 3> cells;               ///< their number
  std::array<std::int64_t, 3> last;          ///< of the places in the grid, kMaxDepth binary digits after the point
};

/// Where queries start their descent: the nodes of the octree at one depth, laid out as a grid, so that a point finds
/// its own at once. Made from the nodes when a field is; not stored.
struct Directory {
  GridFrame frame;
  int depth = 0;
  std::int64_t row = 0, slab = 0;  ///< entries along x, along x and y
  /// x fastest. A node's bits, bits 40 to 47 its depth: below `depth` for a leaf that covers several entries.
  std::vector<std::uint64_t> entries;
  /// How far the leaves of a blended field reach (`namespace reach`): by node, then by entry; 0 where that is no leaf.
  /// Empty without blending.
  std::vector<std::uint32_t> reaches;

  static constexpr std::uint64_t entry(std::uint64_t node, int depth) { return node | std::uint64_t(depth) << 40; }
  static constexpr int depthOf(std::uint64_t entry) { return static_cast<int>(entry >> 40 & 0xff); }
};

/// A hierarchical hp-adaptive signed distance field: immutable; every query is const, thread-safe and allocation-free.
///
/// Inside the domain the value is the polynomial of the leaf that holds the point; leaves are half-open, so that every
/// point has exactly one. The field jumps slightly from leaf to leaf, unless it is blended (`FieldData::blend`): then
/// f = Σ wₙ fₙ / Σ wₙ over the leaves n that reach a point, fₙ being their polynomials continued beyond their boxes and
/// wₙ products of smooth steps across their sides, so that value and gradient are continuous throughout the domain;
/// away from the faces the leaf answers alone, as before, to the bit.
///
/// Outside the domain it is f(q) + |x - q| with q the closest point of the domain, with the matching gradient: the
/// value is continuous across the domain's boundary. Jumps between two leaves there go on outwards; a blended field has
/// none outside either, and its gradient jumps at the boundary alone. It is an upper bound of a 1-Lipschitz field, so
/// that outside a value is no safe length for a step of sphere tracing. Of infinite points the value is infinite and
/// the gradient NaN.
class Field {
 public:
  /// Takes finished arrays; throws `Error` when they do not make a field (see `FieldData`).
  explicit Field(FieldData data);

  double value(const Vector3& x) const;
  ValueAndGradient valueAndGradient(const Vector3& x) const;

  /// Batched; the spans have equal length. The same results as one at a time.
  void values(std::span<const Vector3> points, std::span<double> out) const;
  void valuesAndGradients(std::span<const Vector3> points, std::span<ValueAndGradient> out) const;

  /// The leaf that holds x, or, for x outside, the domain's closest point.
  Cell cellAt(const Vector3& x) const;

  /// Calls `visit` for every leaf, in the order of the octree (base cells first to last, children 0 to 7).
  void forEachCell(const std::function<void(const Cell&)>& visit) const;

  const Box& domain() const { return data_.domain; }
  const std::array<std::uint32_t, 3>& grid() const { return data_.grid; }
  const FieldMetadata& metadata() const { return data_.metadata; }
  bool singlePrecision() const { return data_.coefficients.index() == 1; }

  /// The arrays themselves: for files, uploads and tests.
  const FieldData& data() const { return data_; }

  /// Where queries start: for uploads and tests too.
  const Directory& directory() const { return directory_; }

  /// Bytes that queries need: nodes, coefficients, directory, and bounds where they are kept.
  std::size_t bytes() const;

 private:
  FieldData data_;
  Directory directory_;
};

/// Figures over a whole field.
struct FieldStatistics {
  std::size_t leaves = 0;
  std::size_t nodes = 0;
  std::size_t coefficients = 0;
  std::size_t bytes = 0;               ///< `Field::bytes`
  std::map<int, double> degreeVolume;  ///< degree → fraction of the domain's volume
  std::map<int, double> depthVolume;   ///< depth → fraction of the domain's volume
  std::map<int, std::size_t> degreeLeaves;
  std::map<int, std::size_t> depthLeaves;
};

FieldStatistics statistics(const Field& field);

}  // namespace hpsdf
