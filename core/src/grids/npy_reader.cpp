// Reads arrays of NumPy. Source: NumPy's documentation, numpy.lib.format.
#include <charconv>
#include <cstdint>
#include <string>
#include <vector>

#include "grids/grid_memory.h"
#include "grids/read_grid.h"
#include "hpsdf/detail/text.h"
#include "util/refuse.h"

namespace hpsdf::grids {
namespace {

/// The contents of an array's header.
struct NpyHeader {
  bool isDouble = false;
  bool isFortranOrder = false;  ///< the first index runs fastest
  std::vector<std::uint64_t> shape;
  std::size_t firstNumber = 0;  ///< where the numbers begin
};

/// Returns the text behind a key of the header's dictionary.
std::string_view valueOfKey(std::string_view header, std::string_view key) {
  const std::size_t at = header.find(key);
  if (at == std::string_view::npos) detail::refuse("the header of the array has no ", key);
  return trimmed(header.substr(header.find(':', at) == std::string_view::npos ? at : header.find(':', at) + 1));
}

std::vector<std::uint64_t> shapeOf(std::string_view text) {
  std::vector<std::uint64_t> shape;
  const std::size_t end = text.find(')');
  if (!text.starts_with('(') || end == std::string_view::npos) detail::refuse("the shape of the array is damaged");
  text = text.substr(1, end - 1);
  while (!(text = trimmed(text)).empty()) {
    std::uint64_t size = 0;
    const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), size);
    if (error != std::errc() || shape.size() == 8) detail::refuse("the shape of the array is damaged");
    shape.push_back(size);
    text = trimmed(text.substr(std::size_t(rest - text.data())));
    if (text.starts_with(',')) text.remove_prefix(1);
  }
  return shape;
}

NpyHeader headerOf(std::string_view bytes) {
  constexpr std::string_view kMagic = "\x93NUMPY";
  if (!bytes.starts_with(kMagic) || bytes.size() < 12) detail::refuse("this is no array of NumPy");
  // Since version 2 of the format, the length of the header has four bytes instead of two.
  const bool isLong = bytes[6] >= 2;
  const std::size_t begin = isLong ? 12 : 10;
  const std::size_t length =
      isLong ? numberAt<std::uint32_t>(bytes.data() + 8) : std::size_t{numberAt<std::uint16_t>(bytes.data() + 8)};
  if (length > bytes.size() - begin) detail::refuse("the file ends within the header of the array");
  const std::string_view text = bytes.substr(begin, length);
  const std::string_view type = valueOfKey(text, "'descr'").substr(0, 5);
  if (type != "'<f4'" && type != "'<f8'")
    detail::refuse("the array has the type ", shownText(type),
                   "; expected little-endian floats or doubles ('<f4' or '<f8')");
  return {.isDouble = type == "'<f8'",
          .isFortranOrder = valueOfKey(text, "'fortran_order'").starts_with("True"),
          .shape = shapeOf(valueOfKey(text, "'shape'")),
          .firstNumber = begin + length};
}

}  // namespace

RegularGrid readNpy(std::string_view bytes) {
  const NpyHeader header = headerOf(bytes);
  const auto& shape = header.shape;
  const std::size_t components = shape.size() == 4 ? 4 : 1;
  if (shape.size() < 3 || shape.size() > 4 || (shape.size() == 4 && shape[3] != 4))
    detail::refuse("the array has ", shape.size(),
                   " axes; expected the shape (nz, ny, nx), or (nz, ny, nx, 4) with values and gradients");
  requireReadableGrid(double(shape[2]), double(shape[1]), double(shape[0]), 2 * sizeof(double));
  const std::size_t count = std::size_t(shape[0]) * shape[1] * shape[2];
  const std::size_t size = header.isDouble ? sizeof(double) : sizeof(float);
  const std::string_view numbers = bytes.substr(header.firstNumber);
  if (numbers.size() / size / components < count) detail::refuse("the file ends before the last number of the array");
  RegularGrid grid;
  grid.layout.points = {std::uint32_t(shape[2]), std::uint32_t(shape[1]), std::uint32_t(shape[0])};
  grid.values.resize(count);
  const auto& [nx, ny, nz] = grid.layout.points;
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t x = n % nx, y = n / nx % ny, z = n / nx / ny;
    const std::size_t place = header.isFortranOrder ? z + nz * (y + std::size_t{ny} * x) : n * components;
    const char* const at = numbers.data() + size * place;
    grid.values[n] = header.isDouble ? numberAt<double>(at) : double(numberAt<float>(at));
  }
  return grid;
}

}  // namespace hpsdf::grids
