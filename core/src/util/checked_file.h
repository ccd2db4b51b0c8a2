#pragma once
// Files of numbers with a checksum at the end: the `.hpsdf` file, the checkpoint of a construction.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "hpsdf/detail/output_file.h"

struct XXH3_state_s;

namespace hpsdf {

static_assert(std::endian::native == std::endian::little, "files are little-endian and arrays are written as they are");
static_assert(sizeof(double) == 8 && std::numeric_limits<double>::is_iec559);
static_assert(sizeof(float) == 4 && std::numeric_limits<float>::is_iec559);

template <typename T>
std::span<const std::byte> bytesOf(const T& value) {
  static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
  return std::as_bytes(std::span(&value, 1));
}

/// XXH3 (64 bits) over all bytes handed to it.
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

/// Writer and reader have the same members for items, so that one function can list them for both directions.
class CheckedWriter {
 public:
  /// Throws as `OutputFile` does, here and wherever it writes.
  explicit CheckedWriter(const std::filesystem::path& file) : output_(file) {}

  template <typename T>
  void item(const T& value) {
    put(bytesOf(value));
  }
  void flag(bool value) { item(std::uint8_t{value}); }
  void text(std::string_view value);
  template <typename T>
  void array(std::span<const T> values) {
    put(std::as_bytes(values));
  }
  /// The checksum; then the file gets its name.
  void finish();

 private:
  void put(std::span<const std::byte> bytes);

  OutputFile output_;
  Checksum checksum_;
};

/// What a reader's errors say of its file.
struct FileKind {
  std::string_view name;    ///< "field file"
  std::string_view wanted;  ///< "a .hpsdf file"
  std::string_view remedy;  ///< for a damaged one: "build or copy it again"
};

/// Every member throws `Error` where the file ends too early, or says what cannot be.
class CheckedReader {
 public:
  /// Throws `Error` for a file that is missing, of another type than a regular one, or not to be opened.
  CheckedReader(const std::filesystem::path& file, const FileKind& kind);

  template <typename T>
  void item(T& value) {
    get(std::as_writable_bytes(std::span(&value, 1)));
  }
  void flag(bool& value);
  void text(std::string& value);
  /// An array whose size the file's length must allow, looked at before memory is taken.
  template <typename T>
  void array(std::vector<T>& values, std::uint64_t count) {
    if (count > remaining() / sizeof(T)) damaged("it ends too early");
    values.resize(count);
    get(std::as_writable_bytes(std::span(values)));
  }
  /// Expects the checksum, and then the end.
  void finish();

  std::uint64_t remaining() const { return size_ - position_; }
  [[noreturn]] void damaged(const std::string& how) const;
  [[noreturn]] void refuse(const std::string& why) const;

 private:
  void get(std::span<std::byte> bytes);

  std::filesystem::path file_;
  FileKind kind_;
  std::ifstream stream_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;
  Checksum checksum_;
};

}  // namespace hpsdf
