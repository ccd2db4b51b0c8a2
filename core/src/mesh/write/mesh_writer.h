#pragma once

#include <bit>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

static_assert(std::endian::native == std::endian::little, "binary files are written as numbers are in memory");

/// Receives the bytes of a file, in pieces.
using WriteBytes = std::function<void(std::span<const std::byte>)>;

/// Collects numbers and text, and passes them on in pieces of some 64 kB. The owner calls `finish` at the end.
class ByteStream {
 public:
  explicit ByteStream(const WriteBytes& write) : write_(write) { bytes_.reserve(kPiece + 256); }

  void add(std::string_view text) {
    bytes_.append(text);
    if (bytes_.size() >= kPiece) finish();
  }

  /// Adds a number as it is in memory: little-endian.
  template <typename Number>
  void addBytesOf(const Number& number) {
    add({reinterpret_cast<const char*>(&number), sizeof(Number)});
  }

  void finish() {
    write_(std::as_bytes(std::span(bytes_)));
    bytes_.clear();
  }

 private:
  static constexpr std::size_t kPiece = 1 << 16;

  const WriteBytes& write_;
  std::string bytes_;
};

// Each of these functions passes the bytes of one file to `write`. STL and glTF hold positions as float; STL has no
// data of vertices.
void writeObj(const TriangleMesh& mesh, const VertexData& data, const WriteBytes& write);
void writePly(const TriangleMesh& mesh, const VertexData& data, const WriteBytes& write);
void writeStl(const TriangleMesh& mesh, const WriteBytes& write);
void writeGlb(const TriangleMesh& mesh, const VertexData& data, const WriteBytes& write);

}  // namespace hpsdf::mesh
