#pragma once
// Members that all streams of numbers share, whether these go into files or into messages.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hpsdf::detail {

/// The first bytes of a file. They identify the type of the file.
using Magic = std::array<char, 8>;

constexpr std::uint32_t kLongestText = 4096;  ///< bytes

/// Base of a class `Stream` that writes numbers. `NumberReader` has members of the same names, so that the same
/// function template can write and read. `Stream` has the members item(number) and put(bytes), of which the latter may
/// be private if this class is a friend.
template <typename Stream>
class NumberWriter {
 public:
  void begin(const Magic& magic, std::uint32_t version) {
    for (const char c : magic) stream().item(c);
    stream().item(version);
  }
  void flag(bool value) { stream().item(std::uint8_t{value}); }
  /// Writes an array without its size. The reader derives the size from other items.
  template <typename Array>
  void array(const Array& values, std::uint64_t) {
    stream().put(std::as_bytes(std::span(values)));
  }
  /// Writes the size of an array and the array.
  template <typename Array>
  void list(const Array& values) {
    stream().item(std::uint64_t{values.size()});
    array(values, values.size());
  }
  /// Writes the length of a text and the text, up to `kLongestText`.
  void text(std::string_view value) {
    const auto length = static_cast<std::uint32_t>(std::min<std::size_t>(value.size(), kLongestText));
    stream().item(length);
    stream().put(std::as_bytes(std::span(value.data(), length)));
  }
  /// Does nothing, because only values that are read can be invalid.
  void require(bool, const char*) const {}

 private:
  Stream& stream() { return static_cast<Stream&>(*this); }
};

/// Base of a class `Stream` that reads what a `NumberWriter` wrote. `Stream` has the members item(number), get(bytes),
/// remaining() and require(holds, how), which throws unless `holds` is true.
template <typename Stream>
class NumberReader {
 public:
  void flag(bool& value) {
    std::uint8_t stored = 0;
    stream().item(stored);
    stream().require(stored <= 1, "a flag is neither 0 nor 1");
    value = stored == 1;
  }
  /// Reads an array of `count` elements. Throws, before memory is allocated, if the elements need more bytes than
  /// remain.
  template <typename T>
  void array(std::vector<T>& values, std::uint64_t count) {
    stream().require(count <= stream().remaining() / sizeof(T), "it ends too early");
    values.resize(count);
    stream().get(std::as_writable_bytes(std::span(values)));
  }
  template <typename T>
  void list(std::vector<T>& values) {
    std::uint64_t count = 0;
    stream().item(count);
    array(values, count);
  }
  void text(std::string& value) {
    std::uint32_t length = 0;
    stream().item(length);
    stream().require(length <= kLongestText, "its name is too long");
    value.resize(length);
    stream().get(std::as_writable_bytes(std::span(value)));
  }

 private:
  Stream& stream() { return static_cast<Stream&>(*this); }
};

}  // namespace hpsdf::detail
