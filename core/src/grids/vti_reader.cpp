// Reads image data of VTK. Source: "VTK XML Formats", docs.vtk.org.
#include <zlib.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "grids/grid_memory.h"
#include "grids/read_grid.h"
#include "grids/xml_tags.h"
#include "hpsdf/detail/text.h"
#include "util/refuse.h"

namespace hpsdf::grids {
namespace {

/// Returns the numbers of a text, or fewer than `count` or none if it holds anything else.
std::vector<double> numbersIn(std::string_view text, std::size_t count) {
  std::vector<double> numbers;
  while (!(text = trimmed(text)).empty()) {
    double number = 0;
    const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || !std::isfinite(number) || numbers.size() == count) return {};
    numbers.push_back(number);
    text.remove_prefix(std::size_t(rest - text.data()));
  }
  return numbers;
}

/// Returns the numbers that the file gives under a name such as "Spacing", which must be `count`.
std::vector<double> numbersOf(const Tag& tag, std::string_view name, std::size_t count) {
  const std::string_view text = tag.attribute(name);
  std::vector<double> numbers = numbersIn(text, count);
  if (numbers.size() != count)
    detail::refuse("expected ", count, count == 1 ? " number" : " numbers", " as ", name, " of the grid, found '",
                   shownText(text), "'");
  return numbers;
}

/// Returns numbers that must be whole and from `least` to `most`.
std::vector<double> wholeNumbersOf(const Tag& tag, std::string_view name, std::size_t count, double least,
                                   double most) {
  std::vector<double> numbers = numbersOf(tag, name, count);
  for (const double number : numbers)
    if (number != std::floor(number) || number < least || number > most)
      detail::refuse("expected whole numbers of 32 bits as ", name, " of the grid, found '",
                     shownText(tag.attribute(name)), "'");
  return numbers;
}

/// Returns the numbers that the letters of base64 stand for, and −1 for all other bytes.
std::array<std::int8_t, 256> base64Digits() {
  constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::array<std::int8_t, 256> digits;
  digits.fill(-1);
  for (std::size_t n = 0; n < kLetters.size(); ++n)
    digits[static_cast<unsigned char>(kLetters[n])] = static_cast<std::int8_t>(n);
  return digits;
}

/// Returns the first `count` bytes that a text in base64 stands for, or fewer if it ends before. Padding ends a group
/// of four letters; further groups may follow.
std::string decodeBase64(std::string_view text, std::size_t count) {
  static const std::array<std::int8_t, 256> digits = base64Digits();
  std::string bytes;
  std::uint32_t group = 0;
  int letters = 0, padding = 0;
  for (const char c : text) {
    if (bytes.size() >= count || c == '<') break;
    const std::int8_t digit = digits[static_cast<unsigned char>(c)];
    if (digit < 0 && c != '=') continue;  // line ends and blanks
    padding += c == '=' ? 1 : 0;
    group = group << 6 | std::uint32_t(c == '=' ? 0 : digit);
    if (++letters < 4) continue;
    for (int n = 0; n < 3 - padding; ++n) bytes += static_cast<char>(group >> (16 - 8 * n) & 0xff);
    group = 0;
    letters = padding = 0;
  }
  bytes.resize(std::min(bytes.size(), count));
  return bytes;
}

constexpr std::size_t kMostArrays = 10'000;

/// The encoding of a file's arrays.
struct Encoding {
  bool hasLongHeaders = false;  ///< sizes have 64 bits instead of 32
  bool isCompressed = false;
  bool isAppendedRaw = false;  ///< the appended arrays are bytes, not base64
  std::string_view appended;   ///< what follows the underscore of the appended data

  std::size_t bytesOfSize() const { return hasLongHeaders ? 8 : 4; }
};

/// An array as it is stored, behind its header.
class StoredArray {
 public:
  StoredArray(std::string_view stored, bool isRaw, const Encoding& encoding)
      : stored_(stored), isRaw_(isRaw), encoding_(encoding) {}

  /// Returns the array, which must have `size` bytes.
  std::string bytes(std::size_t size) const {
    const std::size_t width = encoding_.bytesOfSize();
    if (!encoding_.isCompressed) {
      if (sizeAt(first(width), 0) != size) refuseSize();
      return first(width + size).substr(width);
    }
    const std::string start = first(3 * width);
    const std::uint64_t blocks = sizeAt(start, 0), bytesOfBlock = sizeAt(start, 1), bytesOfLast = sizeAt(start, 2);
    const std::uint64_t wholeBlocks = blocks - (bytesOfLast > 0 ? 1 : 0);
    if (blocks == 0 || bytesOfBlock == 0 || blocks > size || (wholeBlocks > 0 && bytesOfBlock > size / wholeBlocks) ||
        wholeBlocks * bytesOfBlock + bytesOfLast != size)
      refuseSize();
    return decompressed(size, blocks, bytesOfBlock);
  }

 private:
  [[noreturn]] static void refuseSize() {
    detail::refuse("the array of distances does not have as many numbers as the grid has points");
  }

  /// Returns the first bytes of the stored array.
  std::string first(std::size_t count) const {
    std::string bytes = isRaw_ ? std::string(stored_.substr(0, count)) : decodeBase64(stored_, count);
    if (bytes.size() < count) detail::refuse("the file ends within the array of distances");
    return bytes;
  }

  std::uint64_t sizeAt(const std::string& bytes, std::size_t number) const {
    const char* const at = bytes.data() + number * encoding_.bytesOfSize();
    return encoding_.hasLongHeaders ? numberAt<std::uint64_t>(at) : numberAt<std::uint32_t>(at);
  }

  std::string decompressed(std::size_t size, std::uint64_t blocks, std::uint64_t bytesOfBlock) const {
    const std::size_t headerSize = (3 + blocks) * encoding_.bytesOfSize();
    const std::string header = first(headerSize);
    std::uint64_t compressedSize = 0;
    for (std::uint64_t n = 0; n < blocks; ++n) {
      const std::uint64_t some = sizeAt(header, 3 + n);
      if (some > stored_.size() - compressedSize) detail::refuse("the file ends within the array of distances");
      compressedSize += some;
    }
    const std::string all = first(headerSize + compressedSize);
    constexpr double kGreatestExpansion = 1032;  // of zlib
    if (double(size) > kGreatestExpansion * double(compressedSize))
      detail::refuse("the compressed array of distances is damaged");
    std::string bytes(size, '\0');
    std::size_t from = headerSize, to = 0;
    for (std::uint64_t n = 0; n < blocks; ++n) {
      const std::uint64_t some = sizeAt(header, 3 + n);
      uLongf length = std::min<std::uint64_t>(bytesOfBlock, size - to);
      const uLongf expected = length;
      if (uncompress(reinterpret_cast<Bytef*>(bytes.data() + to), &length,
                     reinterpret_cast<const Bytef*>(all.data() + from), some) != Z_OK ||
          length != expected)
        detail::refuse("the compressed array of distances is damaged");
      from += some;
      to += expected;
    }
    return bytes;
  }

  std::string_view stored_;
  bool isRaw_;
  const Encoding& encoding_;
};

/// Returns the numbers of an array of text.
std::vector<double> textNumbers(std::string_view text, std::size_t count) {
  std::vector<double> numbers = numbersIn(takeUntil(text, "<"), count);
  if (numbers.size() != count) detail::refuse("the array of distances does not hold ", count, " finite numbers");
  return numbers;
}

std::vector<double> numbersFrom(const std::string& bytes, bool isDouble, std::size_t count) {
  std::vector<double> numbers(count);
  for (std::size_t n = 0; n < count; ++n)
    numbers[n] = isDouble ? numberAt<double>(&bytes[8 * n]) : double(numberAt<float>(&bytes[4 * n]));
  return numbers;
}

/// Reads the numbers of a data array.
std::vector<double> readArray(const Tag& array, const Encoding& encoding, std::size_t count) {
  const std::string_view type = array.attribute("type"), format = array.attribute("format");
  if (type != "Float32" && type != "Float64")
    detail::refuse("the array of distances has the type '", shownText(type), "'; expected Float32 or Float64");
  if (format == "ascii") return textNumbers(array.rest, count);
  const bool isDouble = type == "Float64", isAppended = format == "appended";
  std::string_view stored = array.rest;
  if (isAppended) {
    const double offset = numbersOf(array, "offset", 1)[0];
    if (!(offset >= 0) || offset != std::floor(offset) || offset >= double(encoding.appended.size()))
      detail::refuse("the array of distances begins behind the end of the file");
    stored = encoding.appended.substr(std::size_t(offset));
  }
  const StoredArray whole(stored, isAppended && encoding.isAppendedRaw, encoding);
  return numbersFrom(whole.bytes(count * (isDouble ? 8 : 4)), isDouble, count);
}

/// The contents of a file's elements, before its arrays are read.
struct ImageDescription {
  Encoding encoding;
  RegularGrid grid;
  std::string_view scalars;  ///< name of the array of distances, or ""
  std::vector<Tag> arrays;   ///< of the points
};

void takeFile(const Tag& tag, ImageDescription& image) {
  if (tag.attribute("type") != "ImageData")
    detail::refuse("this is a file of VTK with '", shownText(tag.attribute("type")), "'; expected ImageData (.vti)");
  if (tag.attribute("byte_order") == "BigEndian") detail::refuse("the file is big-endian; expected little-endian");
  const std::string_view compressor = tag.attribute("compressor");
  if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
    detail::refuse("the file is compressed by '", shownText(compressor), "'; expected vtkZLibDataCompressor, or none");
  image.encoding.isCompressed = !compressor.empty();
  image.encoding.hasLongHeaders = tag.attribute("header_type") == "UInt64";
}

void takeImage(const Tag& tag, ImageDescription& image) {
  using Integers = std::numeric_limits<std::int32_t>;
  const auto extent = wholeNumbersOf(tag, "WholeExtent", 6, Integers::min(), Integers::max());
  const auto origin = numbersOf(tag, "Origin", 3), spacing = numbersOf(tag, "Spacing", 3);
  const bool hasAxes = !tag.attribute("Direction").empty();
  if (hasAxes && numbersOf(tag, "Direction", 9) != std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1})
    detail::refuse("the grid is rotated (Direction); expected one along the axes");
  GridLayout& layout = image.grid.layout;
  Vector3 points;
  for (int axis = 0; axis < 3; ++axis) {
    points[axis] = extent[2 * axis + 1] - extent[2 * axis] + 1;
    layout.spacing[axis] = spacing[axis];
    layout.origin[axis] = origin[axis] + extent[2 * axis] * spacing[axis];
  }
  requireReadableGrid(points[0], points[1], points[2], 3 * sizeof(double));
  for (int axis = 0; axis < 3; ++axis) layout.points[axis] = std::uint32_t(points[axis]);
}

/// Reads the elements of a file up to its appended data.
ImageDescription describe(std::string_view bytes) {
  ImageDescription image;
  int pieces = 0;
  bool isInPoints = false;
  Tag tag = nextTag(bytes);
  if (tag.name != "VTKFile") detail::refuse("this is no file of VTK in XML");
  takeFile(tag, image);
  for (; !tag.name.empty(); tag = nextTag(tag.rest)) {
    if (tag.name == "ImageData") takeImage(tag, image);
    if (tag.name == "Piece") ++pieces;
    if (tag.name == "PointData") image.scalars = tag.attribute("Scalars");
    if (tag.name == "PointData" || tag.name == "CellData" || tag.name == "FieldData")
      isInPoints = tag.name == "PointData";
    if (tag.name == "DataArray" && isInPoints) image.arrays.push_back(tag);
    if (image.arrays.size() > kMostArrays) detail::refuse("the points have more than ", kMostArrays, " arrays");
    if (tag.name != "AppendedData") continue;
    image.encoding.isAppendedRaw = tag.attribute("encoding") == "raw";
    const std::size_t mark = tag.rest.find('_');
    image.encoding.appended = mark == std::string_view::npos ? "" : tag.rest.substr(mark + 1);
    break;
  }
  if (pieces != 1) detail::refuse("the grid has ", pieces, " pieces; expected one");
  return image;
}

/// Returns the array of distances: the scalars or, if the file names none, the only array of single numbers.
const Tag& distancesOf(const ImageDescription& image) {
  const Tag* found = nullptr;
  for (const Tag& array : image.arrays) {
    const std::string_view components = array.attribute("NumberOfComponents");
    if (!components.empty() && components != "1") continue;
    if (!image.scalars.empty() && array.attribute("Name") != image.scalars) continue;
    if (found != nullptr) detail::refuse("the points have several arrays, of which none is named as Scalars");
    found = &array;
  }
  if (found == nullptr) detail::refuse("the points of the grid have no array of single numbers");
  return *found;
}

}  // namespace

RegularGrid readVti(std::string_view bytes) {
  ImageDescription image = describe(bytes);
  image.grid.values = readArray(distancesOf(image), image.encoding, image.grid.layout.count());
  return std::move(image.grid);
}

}  // namespace hpsdf::grids
