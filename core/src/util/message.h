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
#include "util/number_stream.h"

namespace hpsdf::detail {

using Message = std::vector<std::byte>;

/// Writes numbers to a message.
class MessageWriter : public NumberWriter<MessageWriter> {
 public:
  template <typename T>
  void item(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    put(std::as_bytes(std::span(&value, 1)));
  }
  void text(std::string_view value) {
    item(std::uint64_t{value.size()});
    put(std::as_bytes(std::span(value)));
  }

  Message take() { return std::move(bytes_); }

 private:
  friend NumberWriter;
  void put(std::span<const std::byte> bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }

  Message bytes_;
};

/// Reads what a `MessageWriter` wrote. Throws `Error` if a message ends too early or holds an impossible value.
class MessageReader : public NumberReader<MessageReader> {
 public:
  explicit MessageReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <typename T>
  void item(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    get(std::as_writable_bytes(std::span(&value, 1)));
  }
  void text(std::string& value) {
    std::uint64_t size = 0;
    item(size);
    require(size <= remaining(), "a text is cut off");
    value.resize(size);
    get(std::as_writable_bytes(std::span(value)));
  }
  void require(bool holds, const char* how) const {
    if (!holds) throw Error(std::string("a message of another process is damaged: ") + how);
  }
  std::size_t remaining() const { return bytes_.size(); }
  bool isAtEnd() const { return bytes_.empty(); }

 private:
  friend NumberReader;
  void get(std::span<std::byte> to) {
    require(to.size() <= remaining(), "it ends too early");
    if (!to.empty()) std::memcpy(to.data(), bytes_.data(), to.size());
    bytes_ = bytes_.subspan(to.size());
  }

  std::span<const std::byte> bytes_;
};

}  // namespace hpsdf::detail
