#pragma once
// Streams of bytes in field files, each compressed as one frame of zstd, and arrays of numbers as such streams.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "util/checked_file.h"

struct ZSTD_CCtx_s;
struct ZSTD_DCtx_s;

namespace hpsdf::io {

using Bytes = std::vector<std::uint8_t>;

/// Returns the bytes of an array.
template <typename T>
Bytes bytesOf(const std::vector<T>& values) {
  const auto* first = reinterpret_cast<const std::uint8_t*>(values.data());
  return {first, first + values.size() * sizeof(T)};
}

/// Compressed streams that are written one after the other. The bytes depend on nothing but the content and the version
/// of zstd.
class StreamsWriter {
 public:
  StreamsWriter();

  /// Adds a stream. Bytes whose number is 0 make no stream.
  void add(std::span<const std::uint8_t> bytes);

  /// Adds a number as it is.
  template <typename T>
  void addNumber(T number) {
    const std::size_t end = packed_.size();
    packed_.resize(end + sizeof number);
    std::memcpy(packed_.data() + end, &number, sizeof number);
  }

  /// Adds all that was added to another writer.
  void append(const StreamsWriter& other) { packed_.insert(packed_.end(), other.packed_.begin(), other.packed_.end()); }

  /// Adds an array as its byte planes: for k = 0, 1, … a stream of the bytes number k of all values. Bytes of the same
  /// significance resemble each other more than the bytes of one number do.
  template <typename Array>
  void addPlanes(const Array& array) {
    const std::span values(array);
    using T = typename decltype(values)::value_type;
    static_assert(std::is_trivially_copyable_v<T>);
    const auto* from = reinterpret_cast<const std::uint8_t*>(values.data());
    Bytes plane(values.size());
    for (std::size_t k = 0; k < sizeof(T); ++k) {
      for (std::size_t i = 0; i < plane.size(); ++i) plane[i] = from[i * sizeof(T) + k];
      add(plane);
    }
  }

  /// Returns the number of bytes that `write` writes.
  std::size_t size() const { return packed_.size(); }

  /// Writes all streams, each as the number of its compressed bytes (u64) and these bytes.
  void write(detail::CheckedWriter& writer) const { writer.array(packed_, packed_.size()); }

 private:
  struct Free {
    void operator()(ZSTD_CCtx_s* context) const;
  };
  std::unique_ptr<ZSTD_CCtx_s, Free> context_;
  Bytes packed_;
};

/// Reads the streams that `StreamsWriter` wrote. The caller knows their sizes from elsewhere. Throws `Error` like
/// `CheckedReader` for a stream that has another size or is damaged. Memory is taken only for sizes that the stream's
/// compressed bytes can hold.
class StreamsReader {
 public:
  explicit StreamsReader(detail::CheckedReader& file);

  /// Reads a stream of `size` bytes; none if that is 0.
  Bytes read(std::uint64_t size);

  /// Reads a number that was added by `StreamsWriter::addNumber`.
  template <typename T>
  void readNumber(T& number) {
    file_->item(number);
  }

  /// Reads an array of `count` values that was added by `StreamsWriter::addPlanes`.
  template <typename T>
  void readPlanes(std::vector<T>& values, std::uint64_t count) {
    values.clear();
    for (std::size_t k = 0; k < sizeof(T); ++k) {
      const Bytes plane = read(count);
      values.resize(plane.size());  // after the first plane, whose bytes prove the count
      auto* to = reinterpret_cast<std::uint8_t*>(values.data());
      for (std::size_t i = 0; i < plane.size(); ++i) to[i * sizeof(T) + k] = plane[i];
    }
  }

  void require(bool holds, const char* how) const { file_->require(holds, how); }

 private:
  struct Free {
    void operator()(ZSTD_DCtx_s* context) const;
  };
  detail::CheckedReader* file_;
  std::unique_ptr<ZSTD_DCtx_s, Free> context_;
};

}  // namespace hpsdf::io
