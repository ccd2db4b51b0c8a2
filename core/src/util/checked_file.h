#pragma once
// Files of numbers that end with a checksum: `.hpsdf` files and checkpoints of constructions.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "hpsdf/detail/output_file.h"
#include "util/number_stream.h"

struct XXH3_state_s;

namespace hpsdf::detail {

static_assert(std::endian::native == std::endian::little, "files are little-endian and arrays are written as they are");
static_assert(sizeof(double) == 8 && std::numeric_limits<double>::is_iec559);
static_assert(sizeof(float) == 4 && std::numeric_limits<float>::is_iec559);

template <typename T>
std::span<const std::byte> bytesOf(const T& value) {
  static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
  return std::as_bytes(std::span(&value, 1));
}

constexpr std::size_t kArrayAlignment = 64;  ///< of arrays in files that are mapped: a line of the processor's cache

/// Returns the zeros from a position on to the next multiple of `kArrayAlignment`.
inline std::span<const std::byte> paddingAt(std::size_t position) {
  static constexpr std::array<std::byte, kArrayAlignment> kZeros{};
  return std::span(kZeros).first(-position % kArrayAlignment);
}

/// The XXH3 hash (64 bits) of all bytes that are added with `add`.
class Checksum {
 public:
  Checksum();
  void add(std::span<const std::byte> bytes);
  std::uint64_t value() const;

 private:
  struct Free {
    void operator()(XXH3_state_s* state) const;
  };
  std::unique_ptr<XXH3_state_s, Free> state_;
};

/// Writes numbers to a file and then the checksum of these numbers.
class CheckedWriter : public NumberWriter<CheckedWriter> {
 public:
  /// All members of this class throw the same errors as `OutputFile`.
  explicit CheckedWriter(const std::filesystem::path& file) : output_(file) {}

  template <typename T>
  void item(const T& value) {
    put(bytesOf(value));
  }
  /// Writes the checksum and commits the file.
  void finish();

 private:
  friend NumberWriter;
  void put(std::span<const std::byte> bytes);

  OutputFile output_;
  Checksum checksum_;
};

/// The words by which the messages of `CheckedReader` describe a kind of file.
struct FileKind {
  std::string_view name;    ///< the kind of file, such as "field file"
  std::string_view wanted;  ///< the file that the user should give, such as "a .hpsdf file"
  std::string_view remedy;  ///< the advice for a damaged file, such as "build or copy it again"
};

/// Throws `Error` (of the kind `file`) with a message that tells how a file is damaged.
[[noreturn]] void throwDamaged(const std::filesystem::path& file, const FileKind& kind, const std::string& how);

/// Reads a file that `CheckedWriter` wrote. Every member throws `Error` (of the kind `file`) if the file
/// ends too early or contains an impossible value.
class CheckedReader : public NumberReader<CheckedReader> {
 public:
  /// Opens a file. Throws `Error` (of the kind `file`) for a file that is missing, not a regular file, or cannot be
  /// opened.
  CheckedReader(const std::filesystem::path& file, const FileKind& kind);

  template <typename T>
  void item(T& value) {
    get(std::as_writable_bytes(std::span(&value, 1)));
  }
  /// Reads the first bytes of the file and its version. Returns the version, or std::nullopt if the first
  /// bytes differ from `magic`.
  std::optional<std::uint32_t> begin(const Magic& magic);
  /// Throws unless the stored checksum matches the bytes read and the file ends after the checksum.
  void finish();

  std::uint64_t remaining() const { return size_ - position_; }
  /// Throws `Error` unless `holds` is true. `how` is the part of the message that tells how the file is
  /// damaged.
  void require(bool holds, const char* how) const;
  [[noreturn]] void damaged(const std::string& how) const;
  [[noreturn]] void refuse(const std::string& why) const;

 private:
  friend NumberReader;
  void get(std::span<std::byte> bytes);

  std::filesystem::path file_;
  FileKind kind_;
  std::ifstream stream_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;
  Checksum checksum_;
};

}  // namespace hpsdf::detail
