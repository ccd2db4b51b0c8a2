#pragma once
// The header of a PLY file.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mesh/scan/input.h"

namespace hpsdf::mesh {

enum class PlyType : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

/// Returns the bytes that a number of this type takes.
std::size_t sizeOf(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type;                       ///< type of the number, or of the list's items
  std::optional<PlyType> count = {};  ///< for a list: type of the number of its items
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties = {};

  bool hasList() const;
  /// Returns the bytes that one such element takes in a binary file, at least: lists may be empty.
  std::size_t leastBytes() const;
  /// Returns the index of a property, or std::nullopt if the element has none of this name.
  std::optional<std::size_t> find(const std::string& property) const;
};

struct PlyHeader {
  enum class Format : std::uint8_t { ascii, littleEndian, bigEndian };
  Format format = Format::ascii;
  std::vector<PlyElement> elements = {};
  std::uint64_t lines = 0;  ///< number of lines of the header
};

/// Reads the header, up to the line end behind `end_header`. Throws `Error` that names the line if it is no header of
/// a PLY file.
PlyHeader readPlyHeader(Input& input);

}  // namespace hpsdf::mesh
