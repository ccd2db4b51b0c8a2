#pragma once
// Quantized coefficients: decoding for single queries, and how coefficients are quantized.

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

#include "basis/orthonormal.h"
#include "field/query/evaluate.h"
#include "hpsdf/detail/field_data.h"

namespace hpsdf::query {

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

/// Decodes the coefficients of a leaf of any degree, in units of the step.
void decodeAnyLeaf(const LeafBits& leaf, int degree, std::uint32_t meanBits, double* out);

/// Evaluate a leaf with quantized coefficients, like the overloads for arrays of coefficients in evaluate.h.
void evaluateLeaf(const QuantizedCoefficients& coefficients, const GridFrame& frame, const LeafPoint& leaf,
                  double& value);
void evaluateLeaf(const QuantizedCoefficients& coefficients, const GridFrame& frame, const LeafPoint& leaf,
                  ValueAndGradient& result);

/// Returns the number of bytes that a leaf takes; 0 if it does not lie within the array, or is not well formed.
std::size_t quantizedLeafBytes(const QuantizedCoefficients& coefficients, std::uint64_t leaf);

/// The arrays of a field that differ once its coefficients are quantized.
struct Quantized {
  std::vector<std::uint64_t> nodes;
  QuantizedCoefficients coefficients;
};

/// Rounds the coefficients of a field from double to multiples of `step` in the orthonormal basis. Returns std::nullopt
/// if that takes more bits than `QuantizedCoefficients` has.
std::optional<Quantized> quantized(const FieldData& field, double step);

/// Quantizes the coefficients of a field. Returns false, and leaves the field as it is, where `quantized` has no
/// result.
bool quantize(FieldData& field, double step);

}  // namespace hpsdf::query
