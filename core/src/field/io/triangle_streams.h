#pragma once
// The arrays of exact leaves as streams of bytes that compress well.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "field/io/byte_streams.h"
#include "field/io/field_sizes.h"
#include "hpsdf/detail/exact_triangles.h"

namespace hpsdf::io {

/// Maps small differences, of either sign, to small numbers.
template <typename T>
constexpr T zigzag(T difference) {
  return static_cast<T>((difference << 1) ^ (T{0} - (difference >> (8 * sizeof(T) - 1))));
}
template <typename T>
constexpr T unzigzag(T number) {
  return static_cast<T>((number >> 1) ^ (T{0} - (number & 1)));
}

/// Returns the number of words of the list at `offset`; 0 if there is no whole list.
std::size_t listWords(const std::vector<std::uint32_t>& lists, std::size_t offset);

void addVertices(StreamsWriter& writer, const ExactTriangles& exact);
void readVertices(StreamsReader& reader, const FieldSizes& sizes, ExactTriangles& exact);

void addTriangles(StreamsWriter& writer, const std::vector<std::array<std::uint32_t, 3>>& triangles);
std::vector<std::array<std::uint32_t, 3>> readTriangles(StreamsReader& reader, std::uint64_t count);

void addLists(StreamsWriter& writer, const std::vector<std::uint32_t>& lists);
std::vector<std::uint32_t> readLists(StreamsReader& reader, std::uint64_t words);

}  // namespace hpsdf::io
