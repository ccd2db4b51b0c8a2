#pragma once
// The sizes of a field's arrays, which the header of a field file holds.

#include <cstdint>

#include "hpsdf/detail/field_data.h"

namespace hpsdf::io {

/// Stands in place of the bytes of a coefficient: quantized ones are an array of bytes.
constexpr std::uint32_t kQuantized = sizeof(std::uint8_t);

struct FieldSizes {
  std::uint64_t nodes = 0;
  std::uint64_t coefficients = 0;      ///< number of coefficients, or of bytes if they are quantized
  std::uint32_t coefficientBytes = 8;  ///< bytes of one coefficient, or `kQuantized`
  double step = 0;                     ///< `QuantizedCoefficients::step`
  std::uint32_t meanBits = 0;          ///< `QuantizedCoefficients::meanBits`
  std::uint64_t bounds = 0;
  std::uint32_t vertexBytes = 8;  ///< bytes of one coordinate of a vertex
  std::uint64_t vertices = 0, triangles = 0, lists = 0;

  /// Returns the bytes of the coefficients' array. Numbers are of type double, because headers of damaged files can
  /// hold any sizes.
  double bytesOfCoefficients() const { return double(coefficientBytes) * double(coefficients); }
  /// Returns the bytes of all arrays.
  double bytes() const {
    return sizeof(std::uint64_t) * double(nodes) + bytesOfCoefficients() + sizeof(CellBound) * double(bounds) +
           3.0 * vertexBytes * double(vertices) + 3.0 * sizeof(std::uint32_t) * double(triangles) +
           sizeof(std::uint32_t) * double(lists);
  }
};

}  // namespace hpsdf::io
