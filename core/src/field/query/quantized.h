#pragma once
// Quantized coefficients: decoding for single queries, and how coefficients are quantized.

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

#include "basis/orthonormal.h"
#include "field/query/evaluate.h"
#include "hpsdf/detail/field_data.h"
#include "util/across_parts.h"

namespace hpsdf::query {

/// Returns the lowest bits of a word. `count` is below 64.
constexpr std::uint64_t lowBits(std::uint64_t word, int count) { return word & ((std::uint64_t{1} << count) - 1); }

/// Appends numbers of few bits to an array of bytes.
class BitWriter {
 public:
  explicit BitWriter(std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}

  void add(std::uint64_t number, int width) {
    pending_ |= number << count_;
    for (count_ += width; count_ >= 8; count_ -= 8, pending_ >>= 8) bytes_.push_back(std::uint8_t(pending_));
  }

  /// Fills the last byte with zeros.
  void finishByte() {
    if (count_ > 0) add(0, 8 - count_);
  }

 private:
  std::vector<std::uint8_t>& bytes_;
  std::uint64_t pending_ = 0;
  int count_ = 0;
};

/// The bits of one leaf.
struct LeafBits {
  const std::uint8_t* bytes;

  std::uint64_t begin() const { return 0; }
  std::uint64_t head() const { return read(0); }
  std::uint64_t readAllAt(std::uint32_t position) const { return read(position); }  ///< like that of several leaves

  /// Returns at least 57 bits from the bit `position` on, the first in the lowest bit.
  std::uint64_t read(std::uint64_t position) const {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes + (position >> 3), sizeof word);
    return word >> (position & 7);
  }
};

/// The most bytes from the first one of a leaf on that are read to decode it, whatever its widths are.
constexpr std::size_t mostQuantizedBytes(int degree) {
  const int bits = degree * QuantizedCoefficients::kWidthBits + QuantizedCoefficients::kMostMeanBits +
                   (coefficientCount(degree) - 1) * QuantizedCoefficients::kMostWideBits;
  return std::size_t(bits) / 8 + QuantizedCoefficients::kPadding;
}

/// Returns a pointer to the bytes of a leaf, like the overload for arrays of coefficients in evaluate.h.
inline const std::uint8_t* leafOf(const QuantizedCoefficients& coefficients, std::uint64_t leaf) {
  const std::size_t offset = node::offset(leaf);
  return coefficients.bytes.at(offset,
                               std::min(mostQuantizedBytes(node::degree(leaf)), coefficients.bytes.size() - offset));
}

/// Decodes the coefficients of any leaf, in units of its step. `leaf` is the packed node.
void decodeAnyLeaf(const QuantizedCoefficients& coefficients, std::uint64_t leaf, double* out);

/// Evaluate a leaf with quantized coefficients, like the overloads for arrays of coefficients in evaluate.h.
void evaluateLeaf(const QuantizedCoefficients& coefficients, const GridFrame& frame, const LeafPoint& leaf,
                  double& value);
void evaluateLeaf(const QuantizedCoefficients& coefficients, const GridFrame& frame, const LeafPoint& leaf,
                  ValueAndGradient& result);
void evaluateLeaf(const QuantizedCoefficients& coefficients, const GridFrame& frame, const LeafPoint& leaf,
                  ValueGradientHessian& result);

/// Returns the number of bytes that a leaf takes; 0 if it does not lie within the array, or is not well formed.
std::size_t quantizedLeafBytes(const QuantizedCoefficients& coefficients, std::uint64_t leaf);

/// The arrays of a field that differ once its coefficients are quantized.
struct Quantized {
  std::vector<std::uint64_t> nodes;
  QuantizedCoefficients coefficients;
};

/// Rounds the coefficients of a field from double. `steps` has an element for each node: the greatest step, in the
/// orthonormal basis, that a leaf may have. The step of the field is the greatest of them, or `fieldStep` unless that
/// is 0. Returns std::nullopt if the coefficients take more bits than `QuantizedCoefficients` has. `parts` are those of
/// a field of which `field` is one.
std::optional<Quantized> quantized(const FieldData& field, std::span<const double> steps, double fieldStep = 0,
                                   const detail::AcrossParts& parts = {});

/// Gives a field these nodes and coefficients in place of its own.
void take(Quantized&& quantized, FieldData& field);

/// Returns the steps of a field's leaves in the form that `quantized` takes.
std::vector<double> stepsOf(const QuantizedCoefficients& coefficients, std::span<const std::uint64_t> nodes);

/// Computes the bytes that the coefficients of a leaf take, if its polynomial is cut to each of the degrees from 0 to
/// `degree`. The mean counts with the bits that it needs in this leaf, so that the result is too small by up to two.
std::array<double, kMaxDegree + 1> quantizedBytesByDegree(std::span<const double> coefficients, int degree,
                                                          double step);
inline double quantizedBytes(std::span<const double> coefficients, int degree, double step) {
  return quantizedBytesByDegree(coefficients, degree, step)[degree];
}

}  // namespace hpsdf::query
