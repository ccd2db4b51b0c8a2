#pragma once
// Quantized coefficients: decoding for single queries, and how coefficients are quantized.

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "basis/orthonormal.h"
#include "field/query/evaluate.h"
#include "hpsdf/detail/field_data.h"

namespace hpsdf::query {

inline double asNumber(std::uint64_t bits) { return std::bit_cast<double>(bits); }

/// The bits of one leaf.
struct LeafBits {
  const std::uint8_t* bytes;

  std::uint64_t begin() const { return 0; }

  /// Returns at least 57 bits from the bit `position` on, the first in the lowest bit.
  std::uint64_t read(std::uint64_t position) const {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes + (position >> 3), sizeof word);
    return word >> (position & 7);
  }
};

#include "field/query/quantized-inl.h"

/// Length of the array into which a leaf of degree P is decoded. What is written behind the coefficients does not
/// matter.
template <int P>
constexpr std::size_t kDecodedSize = std::size_t(coefficientCount(P)) + 3;

/// Decode the integers of a leaf of degree 1 to 4, ordered by total degree, in SIMD.
void decodeIntegers(Constant<1>, const std::uint8_t* leaf, std::uint32_t meanBits, double* out);
void decodeIntegers(Constant<2>, const std::uint8_t* leaf, std::uint32_t meanBits, double* out);
void decodeIntegers(Constant<3>, const std::uint8_t* leaf, std::uint32_t meanBits, double* out);
void decodeIntegers(Constant<4>, const std::uint8_t* leaf, std::uint32_t meanBits, double* out);

/// Decodes the coefficients of a leaf of any degree, in units of the step.
void decodeAnyLeaf(const LeafBits& leaf, int degree, std::uint32_t meanBits, double* out);

/// Decodes a leaf, and returns f(coefficients, degree) with its coefficients in units of the step, for
/// `evaluatePolynomial`.
template <typename F>
auto withDecodedLeaf(const QuantizedCoefficients& coefficients, std::uint64_t leaf, const F& f) {
  const LeafBits bits{coefficients.bytes.data() + node::offset(leaf)};
  const auto decoded = [&](auto known) {
    if constexpr (std::is_same_v<decltype(known), int>) {
      std::array<double, std::size_t(coefficientCount(kMaxDegree))> c;
      decodeAnyLeaf(bits, known, coefficients.meanBits, c.data());
      return f(static_cast<const double*>(c.data()), known);
    } else {
      std::array<double, kDecodedSize<known>> c;
      decodeIntegers(known, bits.bytes, coefficients.meanBits, c.data());
      return f(OrthonormalIntegers<known, double>{c.data()}, known);
    }
  };
  return withDegree(node::degree(leaf), decoded);
}

inline void evaluateLeaf(const QuantizedCoefficients& coefficients, const GridFrame&, const LeafPoint& leaf,
                         double& value) {
  value = coefficients.step * withDecodedLeaf(coefficients, leaf.bits, [&](auto c, auto degree) {
            return evaluatePolynomial(c, degree, leaf.local);
          });
}

inline void evaluateLeaf(const QuantizedCoefficients& coefficients, const GridFrame& frame, const LeafPoint& leaf,
                         ValueAndGradient& result) {
  const auto [value, x, y, z] = withDecodedLeaf(coefficients, leaf.bits, [&](auto c, auto degree) {
    return evaluatePolynomialWithGradient(c, degree, leaf.local);
  });
  const double step = coefficients.step;
  result = {value * step, {x * step, y * step, z * step}};
  toWorldUnits(frame, leaf, result.gradient);
}

/// Returns the number of bytes that a leaf takes; 0 if it does not lie within the array, or is not well formed.
std::size_t quantizedLeafBytes(const QuantizedCoefficients& coefficients, std::uint64_t leaf);

/// Rounds the coefficients of a field from double to multiples of `step` in the orthonormal basis. Returns false, and
/// leaves the field as it is, if that takes more bits than `QuantizedCoefficients` has.
bool quantize(FieldData& field, double step);

}  // namespace hpsdf::query
