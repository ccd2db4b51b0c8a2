#pragma once
// Arrays of numbers as NumPy reads them: .npy, one array (NumPy's format 1.0), and .npz, a zip archive of such files.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace hpsdf::arrays {

/// Receives the bytes of a file, piece by piece.
using WriteBytes = std::function<void(std::span<const std::byte>)>;

/// A view of an array in memory: numbers of one type, the last index running fastest.
struct ArrayView {
  std::string_view type;           ///< NumPy's name of the type, such as "<f4"
  std::vector<std::size_t> shape;  ///< the product of these is the number of elements
  std::span<const std::byte> bytes;
};

/// Returns NumPy's name of a type: "<f4", "<f8", "|u1", "<u4" or "<i4".
template <typename T>
constexpr std::string_view typeName() {
  if constexpr (std::is_same_v<T, float>) return "<f4";
  if constexpr (std::is_same_v<T, double>) return "<f8";
  if constexpr (std::is_same_v<T, std::uint8_t>) return "|u1";
  if constexpr (std::is_same_v<T, std::uint32_t>) return "<u4";
  if constexpr (std::is_same_v<T, std::int32_t>) return "<i4";
}

/// Returns a view of numbers as an array with this shape, whose product must be the number of elements. The view refers
/// to the numbers.
template <typename T>
ArrayView viewOf(std::span<const T> numbers, std::vector<std::size_t> shape) {
  static_assert(!typeName<T>().empty());
  return {typeName<T>(), std::move(shape), std::as_bytes(numbers)};
}

/// Writes an array as a .npy file: a header that tells type and shape, then the numbers in little-endian order.
void writeNpy(const ArrayView& array, const WriteBytes& write);

/// An array of an archive. The name, of ASCII letters, digits and underscores, is the key by which NumPy finds it.
struct NamedArray {
  std::string name;
  ArrayView array;
};

/// Writes arrays as a .npz file: a zip archive with one stored, that is uncompressed, .npy file for each array.
/// Archives of 4 GiB and more use the zip64 records, as NumPy's own do. The bytes depend only on the arrays.
void writeNpz(std::span<const NamedArray> arrays, const WriteBytes& write);

}  // namespace hpsdf::arrays
