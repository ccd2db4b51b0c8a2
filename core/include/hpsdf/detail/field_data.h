#pragma once
// The arrays of a field, and the record of how it was built.

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "hpsdf/build_options.h"
#include "hpsdf/detail/exact_triangles.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/types.h"

namespace hpsdf {

namespace detail {

class CheckedBlocks;

/// Checks those blocks of a mapped file that hold the given bytes of it, unless they were checked before. Throws
/// `Error` (of the kind `file`) if a block does not match its checksum.
void requireBlocks(const CheckedBlocks& blocks, const void* first, std::size_t bytes);

}  // namespace detail

/// An array of numbers that a field owns, or that lies in a mapped file (`Loading::mapped`). Numbers in a file are
/// checked when they are first read, block by block, so that all members that give access to them can throw `Error`.
/// Copies of an array in a file refer to the same file.
template <typename T>
class FieldArray {
 public:
  FieldArray() = default;
  FieldArray(std::vector<T> values) : own_(std::move(values)) {}
  /// Refers to `size` numbers in the mapped file of `blocks`.
  FieldArray(std::shared_ptr<const detail::CheckedBlocks> blocks, const T* first, std::size_t size)
      : blocks_(std::move(blocks)), mapped_(first, size) {}

  std::size_t size() const { return isMapped() ? mapped_.size() : own_.size(); }
  bool isMapped() const { return blocks_ != nullptr; }

  /// Returns a pointer to the number at `first`, from which `count` numbers may be read.
  const T* at(std::size_t first, std::size_t count) const {
    if (isMapped()) [[unlikely]] {
      detail::requireBlocks(*blocks_, mapped_.data() + first, count * sizeof(T));
      return mapped_.data() + first;
    }
    return own_.data() + first;
  }
  /// Returns all numbers. Those in a file are all read and checked; `forEachPiece` does that better if the file is
  /// larger than the memory.
  std::span<const T> all() const { return {at(0, size()), size()}; }
  /// Calls f(numbers) for pieces of the array, from the first one to the last one.
  template <typename F>
  void forEachPiece(const F& f) const {
    for (std::size_t first = 0; first < size(); first += kPiece) {
      const std::size_t count = std::min(kPiece, size() - first);
      f(std::span<const T>(at(first, count), count));
    }
  }
  /// Returns all numbers so that they can be changed. Those in a file are first copied into memory.
  std::vector<T>& values() {
    if (isMapped()) {
      std::vector<T> copies;
      copies.reserve(size());
      forEachPiece([&](std::span<const T> piece) { copies.insert(copies.end(), piece.begin(), piece.end()); });
      *this = FieldArray(std::move(copies));
    }
    return own_;
  }
  /// Returns a pointer to the first number. Only numbers to which `at` has given access may be read through it, and any
  /// may be prefetched.
  const T* data() const { return isMapped() ? mapped_.data() : own_.data(); }

  friend bool operator==(const FieldArray& a, const FieldArray& b) {
    if (a.size() != b.size()) return false;
    bool areEqual = true;
    std::size_t first = 0;
    a.forEachPiece([&](std::span<const T> piece) {
      areEqual = areEqual && std::ranges::equal(piece, std::span(b.at(first, piece.size()), piece.size()));
      first += piece.size();
    });
    return areEqual;
  }

 private:
  static constexpr std::size_t kPiece = (std::size_t{1} << 16) / sizeof(T);

  std::vector<T> own_;
  std::shared_ptr<const detail::CheckedBlocks> blocks_;
  std::span<const T> mapped_;
};

/// The errors |f − Φ| of a finished field f, measured at random points (`measure` in verify.h). Lengths are in the
/// field's own units.
struct Measurement {
  struct Error {
    double rms = 0;
    double max = 0;
  };

  std::uint64_t points = 0;      ///< number of random points, half of them near the surface, half in the domain
  double nearDistance = 0;       ///< greatest distance of the points near the surface from it
  Error near;                    ///< errors near the surface
  Error domain;                  ///< errors over the domain or, if there is one, over the band
  std::uint64_t wrongSigns = 0;  ///< points at which f and Φ have different signs and |Φ| exceeds `signThreshold`
  /// The tolerance within which the field was built, or else ten times the RMS error near the surface.
  double signThreshold = 0;
  /// Share of the surface's area that is torn: the area of the cracks between cells, as wide as f jumps there, over the
  /// area of the surface. It is 0 for a surface without triangles and for a blended field.
  double tornShare = 0;
  Vector3 worst = Vector3::Zero();  ///< the random point with the greatest error
  /// Greatest error over the error that the field's tolerance allows (`AllowedError`); 0 for a field without tolerance.
  double toleranceRatio = 0;
  std::uint64_t beyondTolerance = 0;  ///< points whose error is greater than the tolerance allows
};

/// The record of how a field was built. It is stored with the field, and the command `info` shows it. Lengths
/// are in the field's own units.
struct FieldMetadata {
  Source source;
  /// The settings that took effect. If the target was given as `NearFarError`, `targetError` is the error τ that the
  /// construction reached, and `nearness` is the exponent θ that the construction derived. Field files store the
  /// settings whose `BuildSetting::storedAt` is not 0.
  BuildOptions settings = {
      .targetError = 0, .nearness = 0, .maxDegree = 0, .maxDepth = 0, .strategy = Strategy::hp, .quadrature = 0};
  /// Weighted error ε, scaled to a surface of size 2 like the target error τ; 0 if it is unknown (`hasEstimate`).
  double totalError = 0;
  double referenceLength = 2;          ///< size L of the surface; ε·(L/2)^5 is the error at this size
  std::uint64_t exactEvaluations = 0;  ///< evaluations of Φ during the construction
  /// Number of steps of the construction, each of which raised the degree of a leaf or split a leaf. It is
  /// std::nullopt if the number is unknown, as in files of version 1.
  std::optional<std::uint64_t> steps = {};
  double roundingRms = 0;  ///< RMS change of the field by rounding its coefficients to float; 0 for double
  /// Estimate of the greatest error |f − Φ| of the field f without blending, from points that the construction probed
  /// in the cells; 0 if no maximum error was asked for. The effect of rounding is included if it exceeds a hundredth of
  /// the maximum error. With a tolerance it is the greatest error found in a cell, over the allowed error, times the
  /// tolerance.
  double measuredError = 0;
  /// The result of `measure` for this field. It is std::nullopt if the field was not measured or was changed
  /// afterwards.
  std::optional<Measurement> measurement = {};

  /// Returns the estimated RMS error of the field over the domain, at the end of the construction: √(ε·(L/2)^5 / V)
  /// with the error ε (`totalError`), the surface's size L (`referenceLength`) and the domain's volume V.
  double rmsEstimate(const Box& domain) const;

  /// Returns true if the construction estimated the error, so that `totalError` is known. A construction within a
  /// tolerance estimates none, and its field has none after `weaklyContinuous` or `blended` either.
  bool hasEstimate() const;
};

/// Proven upper bounds that hold throughout one leaf (see `safe_distance.h`).
struct CellBound {
  float error = 0;  ///< bound of |f − Φ| in the field's units
  float slope = 0;  ///< bound of ‖∇f‖
};

/// Coefficients that are stored as integers of few bits (`CoefficientType::quantized`). A coefficient c_ijk of a leaf
/// is q · h · √((2i+1)(2j+1)(2k+1)) with an integer q. The leaf's step h is `step` / 2^s, where the shift s is a number
/// in the leaf's node (see `FieldData`). In this orthonormal basis, rounding to a multiple of the step changes the
/// field by the same amount, as RMS, whichever coefficient it is.
///
/// A leaf of degree p is a string of bits that starts at a byte, lowest bit first:
/// * p numbers of 5 bits, the widths w_1 to w_p,
/// * the integer of degree 0, of `meanBits` bits, or of `kMostMeanBits` bits in a wide leaf,
/// * for each total degree d = 1 to p the (d+1)(d+2)/2 integers with i+j+k = d, of w_d bits each, in lexicographic
///   order of (i, j, k).
/// An integer q of w bits is stored as the number q + 2^(w−1); with w = 0, it is 0 and takes no bits. The widths are at
/// most `kMostBits`, or `kMostWideBits` in a wide leaf. The leaf's node tells whether it is wide.
struct QuantizedCoefficients {
  static constexpr int kWidthBits = 5;      ///< bits of a width
  static constexpr int kMostBits = 19;      ///< 64 bits from a byte on hold three such integers (7 + 3 · 19)
  static constexpr int kMostWideBits = 31;  ///< as many as `kWidthBits` can tell
  static constexpr int kMostMeanBits = 32;  ///< greatest value of `meanBits`
  static constexpr int kMostShift = 31;
  static constexpr std::size_t kPadding = 8;  ///< zero bytes at the end, so that 64 bits can be read at every integer
  static constexpr double kLeastStep = 1e-200, kGreatestStep = 1e200;  ///< within them, leaves have normal numbers

  double step = 0;  ///< from `kLeastStep` to `kGreatestStep`
  std::uint32_t meanBits = 0;
  FieldArray<std::uint8_t> bytes;  ///< the leaves, and `kPadding` zero bytes

  /// Returns the step of a leaf. `leaf` is the packed node.
  double stepOf(std::uint64_t leaf) const {
    const std::uint64_t shift = leaf >> 48 & 31;
    return std::bit_cast<double>(std::bit_cast<std::uint64_t>(step) - (shift << 52));  // step / 2^shift
  }

  friend bool operator==(const QuantizedCoefficients&, const QuantizedCoefficients&) = default;
};

/// The finished octree as arrays. The first nodes are the base cells, x fastest, then y, then z. There are three kinds
/// of nodes:
/// * An internal node has bit 63 clear. Its low 32 bits are the index of its first child (child number x + 2y + 4z).
/// * A leaf with a polynomial has bit 63 set. Its bits 32 to 39 are the degree p, and its low 32 bits are the offset of
///   its n(p) coefficients: an index into the array of coefficients or, for `QuantizedCoefficients`, into its bytes.
///   For these, its bits 48 to 52 are the shift of the leaf's step, and its bit 53 is set if the leaf is wide.
/// * An exact leaf has bit 63 set. Its bits 32 to 39 are `kExactDegree`, its bits 48 and 49 are the `ExactSign`. Its
///   low 32 bits are the offset of its list in `ExactTriangles::lists`.
/// All other bits are 0.
///
/// The polynomial of a leaf is Σ c_ijk L_i(u) L_j(v) L_k(w) over i+j+k ≤ p. Here u, v, w are local coordinates from −1
/// to 1, and L_i is the Legendre polynomial with L_i(1) = 1. The coefficients c_ijk have the unit of length. They are
/// stored in lexicographic order of (i, j, k), k fastest.
struct FieldData {
  Box domain;
  std::array<std::uint32_t, 3> grid = {1, 1, 1};  ///< number of base cells along each axis
  std::vector<std::uint64_t> nodes;
  std::variant<FieldArray<double>, FieldArray<float>, QuantizedCoefficients> coefficients;
  ExactTriangles exact = {};  ///< the triangles of exact leaves; empty if the field has none
  /// Width of the zones along the faces of a leaf in which the leaf is blended with its neighbours, as a fraction of
  /// the leaf's edge: from 0 (no blending) to `kMaxBlend`.
  double blend = 0;
  std::vector<CellBound> bounds = {};  ///< one for each node, 0 for internal nodes; empty if the field has no bounds
  FieldMetadata metadata = {};
};

/// Functions that pack and unpack the bits of an octree node.
namespace node {
constexpr std::uint64_t kLeafBit = std::uint64_t{1} << 63;
constexpr bool isLeaf(std::uint64_t n) { return (n & kLeafBit) != 0; }
constexpr std::uint32_t firstChild(std::uint64_t n) { return static_cast<std::uint32_t>(n); }
constexpr std::uint32_t offset(std::uint64_t n) { return static_cast<std::uint32_t>(n); }
constexpr int degree(std::uint64_t n) { return static_cast<int>((n >> 32) & 0xff); }
constexpr std::uint64_t leaf(int degree, std::uint32_t offset) {
  return kLeafBit | (std::uint64_t(degree) << 32) | offset;
}
constexpr std::uint64_t exactLeaf(ExactSign sign, std::uint32_t offset) {
  return leaf(kExactDegree, offset) | std::uint64_t(sign) << 48;
}
constexpr bool isExact(std::uint64_t n) { return isLeaf(n) && degree(n) == kExactDegree; }
constexpr ExactSign exactSign(std::uint64_t n) { return static_cast<ExactSign>(n >> 48 & 3); }
constexpr int shift(std::uint64_t n) { return static_cast<int>(n >> 48 & 31); }
constexpr bool isWide(std::uint64_t n) { return (n >> 53 & 1) != 0; }
constexpr std::uint64_t quantizedLeaf(int degree, int shift, bool isWide, std::uint32_t offset) {
  return leaf(degree, offset) | std::uint64_t(shift) << 48 | std::uint64_t(isWide) << 53;
}
constexpr bool hasOnlyKnownBits(std::uint64_t n, bool isQuantized) {
  if (!isLeaf(n)) return n <= 0xffffffff;
  if (isExact(n)) return n == exactLeaf(exactSign(n), offset(n));
  return n == (isQuantized ? quantizedLeaf(degree(n), shift(n), isWide(n), offset(n)) : leaf(degree(n), offset(n)));
}
constexpr std::uint64_t internal(std::uint32_t firstChild) { return firstChild; }
}  // namespace node

/// Returns why no field has these base cells and numbers of nodes and bounds, or nullptr if one can have them.
const char* misfitOf(const std::array<std::uint32_t, 3>& grid, std::uint64_t nodes, std::uint64_t bounds);

/// Returns the array that holds coefficients: numbers, or the bytes of quantized ones.
template <typename Coefficients>
auto& arrayOf(Coefficients& coefficients) {
  if constexpr (requires { coefficients.bytes; })
    return coefficients.bytes;
  else
    return coefficients;
}

/// Returns the bytes that the coefficients of a field take.
std::size_t coefficientBytes(const FieldData& field);

/// Returns true if the coefficients lie in a mapped file.
bool isMapped(const FieldData& field);

/// Computes the n(p) coefficients of a leaf of degree p, in the order of `FieldData`.
void decodeLeaf(const QuantizedCoefficients& coefficients, std::uint64_t leaf, double* out);

/// Returns f(c) for a pointer c to the coefficients of a leaf with a polynomial. They are double or float; quantized
/// coefficients are decoded to double. `leaf` is the packed node.
template <typename F>
decltype(auto) withCoefficients(const FieldData& field, std::uint64_t leaf, F&& f) {
  return std::visit(
      [&](const auto& coefficients) -> decltype(auto) {
        if constexpr (requires { coefficients.at(0, 0); }) {
          return f(coefficients.at(node::offset(leaf), coefficientCount(node::degree(leaf))));
        } else {
          std::array<double, std::size_t(coefficientCount(kMaxDegree))> decoded;
          decodeLeaf(coefficients, leaf, decoded.data());
          return f(static_cast<const double*>(decoded.data()));
        }
      },
      field.coefficients);
}

/// Packs the blend extents at the six faces of a leaf into 32 bits. Near a face, the leaf's blending weight grows from
/// 0 outside the leaf to 1 inside. The blend extent is the distance on either side of the face up to which the weight
/// is between 0 and 1. The blend extent is `FieldData::blend` times the edge of the smallest leaf that touches the
/// face. Each face takes 5 bits: the depth of this smallest leaf, or `kDomainFace` if the face lies on the boundary of
/// the domain.
namespace blend_extent {
constexpr int kDomainFace = 31;
constexpr std::uint32_t packed(int axis, bool upper, int depth) {
  return std::uint32_t(depth) << (10 * axis + (upper ? 5 : 0));
}
constexpr int depth(std::uint32_t extents, int axis, bool upper) {
  return static_cast<int>(extents >> (10 * axis + (upper ? 5 : 0)) & 31);
}
}  // namespace blend_extent

/// A leaf of the octree.
struct Cell {
  std::uint32_t id;  ///< index of its node, which identifies the cell within its field
  Box box;           ///< half-open [min, max) up to rounding
  int degree;        ///< `kExactDegree` for an exact leaf
  int depth;         ///< 0 for a base cell
  /// Squared L2 error, estimated from the coefficients of the highest degree (ε_e; paper, eq. 6). It is 0 for an exact
  /// leaf.
  double error;
};

struct ValueAndGradient {
  double value;
  Vector3 gradient;
};

/// A value with its first and second derivatives in world coordinates. The Hessian H_ab = ∂²f/∂x_a∂x_b is symmetric to
/// the bit.
struct ValueGradientHessian {
  double value;
  Vector3 gradient;
  Eigen::Matrix3d hessian;
};

}  // namespace hpsdf
