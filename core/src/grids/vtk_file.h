#pragma once
// Files in the XML formats of VTK. Source: "VTK XML Formats", docs.vtk.org.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"
#include "hpsdf/output/grids.h"

namespace hpsdf::grids {

/// The version that introduced arrays with headers of 64 bits, and the version since which the points of Lagrange cells
/// are numbered as `lagrangePoints` does.
constexpr std::string_view kVtkVersion = "1.0", kVtkVersionOfLagrangeCells = "2.2";

/// An attribute of an XML element: name and value.
using Attribute = std::pair<std::string_view, std::string>;

/// Returns numbers as text, separated by blanks. Doubles read back to the same numbers.
std::string numbersText(std::span<const double> numbers);

/// The text of a file, and its arrays, which follow the text as compressed bytes.
class VtkFile {
 public:
  /// Begins a file in this version of the format, with a data set of this kind, such as "ImageData".
  VtkFile(std::string_view dataSet, std::string_view version, const Progress& progress);

  void open(std::string_view element, std::initializer_list<Attribute> attributes = {});
  void close();  ///< closes the element that was opened last

  /// Adds an array of numbers with `components` numbers for each point or cell. The array is compressed at once.
  template <typename Number>
  void array(std::string_view name, std::span<const Number> numbers, int components = 1) {
    addArray(name, typeName<Number>(), components, std::as_bytes(numbers));
  }
  /// Adds an array of doubles, which are converted to `type`.
  void array(std::string_view name, NumberType type, std::span<const double> numbers, int components = 1);

  /// Closes all elements, writes text and arrays to `out`, and flushes it.
  void write(OutputFile& out);

 private:
  template <typename Number>
  static constexpr std::string_view typeName();

  void addArray(std::string_view name, std::string_view type, int components, std::span<const std::byte> bytes);

  const Progress& progress_;
  std::string text_;
  std::vector<std::string> open_;  ///< elements that are not closed
  std::vector<std::vector<std::byte>> arrays_;
  std::size_t offset_ = 0;  ///< bytes of all arrays
};

template <typename Number>
constexpr std::string_view VtkFile::typeName() {
  if constexpr (std::is_same_v<Number, float>) return "Float32";
  if constexpr (std::is_same_v<Number, double>) return "Float64";
  if constexpr (std::is_same_v<Number, std::uint8_t>) return "UInt8";
  if constexpr (std::is_same_v<Number, std::int64_t>) return "Int64";
}

}  // namespace hpsdf::grids
