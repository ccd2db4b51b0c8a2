#pragma once
// Quantized coefficients as streams of bytes that compress better than their bits do.

#include <cstdint>
#include <span>

#include "field/io/byte_streams.h"
#include "hpsdf/detail/field_data.h"

namespace hpsdf::io {

/// Adds the coefficients as streams of widths and of integers, if they are those of the given leaves one after the
/// other. `leaves` are packed nodes whose offsets are 0. Integers of the same width stand together, because they have
/// the same distribution. Returns false, and adds nothing, if `readQuantized` would not return the same bytes.
bool addQuantized(StreamsWriter& writer, const QuantizedCoefficients& coefficients,
                  std::span<const std::uint64_t> leaves);

/// Reads the streams of `addQuantized`, and returns the `size` bytes of the coefficients.
Bytes readQuantized(StreamsReader& reader, std::uint64_t size, std::uint32_t meanBits,
                    std::span<const std::uint64_t> leaves);

}  // namespace hpsdf::io
