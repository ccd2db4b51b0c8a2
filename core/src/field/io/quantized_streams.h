#pragma once
// Quantized coefficients as streams of bytes that compress better than their bits do.

#include <cstdint>
#include <span>

#include "field/io/byte_streams.h"
#include "hpsdf/detail/field_data.h"

namespace hpsdf::io {

/// Adds the coefficients as streams of widths and of integers, if they are leaves of the given degrees one after the
/// other. Integers of the same width stand together, because they have the same distribution. Returns false, and adds
/// nothing, if `joinedQuantized` would not return the same bytes.
bool addQuantized(StreamsWriter& writer, const QuantizedCoefficients& coefficients,
                  std::span<const std::uint8_t> degrees);

/// Reads the streams of `addQuantized`, and returns the `size` bytes of the coefficients.
Bytes readQuantized(StreamsReader& reader, std::uint64_t size, std::uint32_t meanBits,
                    std::span<const std::uint8_t> degrees);

}  // namespace hpsdf::io
