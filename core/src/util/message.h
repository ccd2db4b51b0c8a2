#pragma once
// Sequences of bytes that processes of one machine type send each other.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "hpsdf/error.h"

namespace hpsdf::detail {

using Message = std::vector<std::byte>;

/// Writes numbers to a message. It has the members of `CheckedWriter` that function templates for both need.
class MessageWriter {
 public:
  template <typename T>
  void item(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    put(std::as_bytes(std::span(&value, 1)));
  }
  void flag(bool value) { item(std::uint8_t{value}); }
  void text(std::string_view value) {
    item(std::uint64_t{value.size()});
    put(std::as_bytes(std::span(value)));
  }
  template <typename T>
  void array(const std::vector<T>& values, std::uint64_t) {
    put(std::as_bytes(std::span(values)));
  }
  template <typename T>
  void list(const std::vector<T>& values) {
    item(std::uint64_t{values.size()});
    array(values, values.size());
  }
  void require(bool, const char*) const {}

  Message take() { return std::move(bytes_); }

 private:
  void put(std::span<const std::byte> bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }

  Message bytes_;
};

/// Reads what a `MessageWriter` wrote. Throws `Error` if a message ends too early or holds an impossible value.
class MessageReader {
 public:
  explicit MessageReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <typename T>
  void item(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    get(std::as_writable_bytes(std::span(&value, 1)));
  }
  void flag(bool& value) {
    std::uint8_t stored = 0;
    item(stored);
    value = stored != 0;
  }
  void text(std::string& value) {
    std::uint64_t size = 0;
    item(size);
    require(size <= bytes_.size(), "a text is cut off");
    value.resize(size);
    get(std::as_writable_bytes(std::span(value)));
  }
  template <typename T>
  void array(std::vector<T>& values, std::uint64_t count) {
    require(count <= bytes_.size() / sizeof(T), "an array is cut off");
    values.resize(count);
    get(std::as_writable_bytes(std::span(values)));
  }
  template <typename T>
  void list(std::vector<T>& values) {
    std::uint64_t count = 0;
    item(count);
    array(values, count);
  }
  void require(bool holds, const char* how) const {
    if (!holds) throw Error(std::string("a message of another process is damaged: ") + how);
  }
  bool isAtEnd() const { return bytes_.empty(); }

 private:
  void get(std::span<std::byte> to) {
    require(to.size() <= bytes_.size(), "it ends too early");
    if (!to.empty()) std::memcpy(to.data(), bytes_.data(), to.size());
    bytes_ = bytes_.subspan(to.size());
  }

  std::span<const std::byte> bytes_;
};

}  // namespace hpsdf::detail
