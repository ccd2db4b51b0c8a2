#include "mesh/read/ply_reader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "mesh/read/ply_header.h"
#include "mesh/scan/mesh_builder.h"
#include "mesh/scan/text_scanner.h"
#include "mesh/scan/word_text.h"

namespace hpsdf::mesh {
namespace {

/// The element that is being read, for errors.
struct PlyPosition {
  const PlyElement* element = nullptr;
  std::uint64_t index = 0;

  std::string text() const {
    return "number " + std::to_string(index + 1) + " of " + std::to_string(element->count) + " of the element '" +
           wordText(element->name) + "'";
  }
};

/// Returns true for a number without a fraction that fits 53 bits. Some files hold the indices of vertices as `float`.
bool isWholeNumber(double number) {
  constexpr double kMost = 0x1p53;
  return std::abs(number) <= kMost && std::floor(number) == number;
}

/// The numbers of a PLY file that is text.
class PlyText {
 public:
  static constexpr std::uint64_t kLeastBytes = 2;  ///< bytes that a number takes: a digit and a blank

  PlyText(Input& input, const PlyHeader& header, const PlyPosition& position)
      : scanner_(input, '\0', header.lines + 1), position_(position) {}

  std::uint64_t leastBytes(const PlyElement& element) const { return kLeastBytes * element.properties.size() - 1; }
  std::uint64_t line() const { return scanner_.line(); }
  bool isAtEnd() { return !scanner_.toWord(); }

  double number(PlyType) {
    toWord();
    return scanner_.number();
  }

  std::int64_t count(PlyType) { return scanner_.wholeNumber("the length of a list"); }

  void skip(PlyType, std::uint64_t numbers) {
    for (; numbers > 0; --numbers) {
      toWord();
      scanner_.word();
    }
  }

  template <typename Take>
  void items(PlyType type, std::uint64_t count, const Take& take) {
    const bool mayHaveFraction = type == PlyType::float32 || type == PlyType::float64;
    for (; count > 0; --count)
      take(mayHaveFraction ? wholeOf(number(type)) : scanner_.wholeNumber("the index of a vertex"));
  }

  /// Skips the rest of the element's line. Some files have more numbers there than their header promises.
  void endElement() { scanner_.skipLine(); }

  [[noreturn]] void refuse(const std::string& problem) const { scanner_.refuse(problem); }

 private:
  std::int64_t wholeOf(double number) const {
    if (!isWholeNumber(number)) refuse("an index is no whole number");
    return std::int64_t(number);
  }

  void toWord() {
    if (!scanner_.toWord()) refuse("the file ends at " + position_.text());
  }

  TextScanner scanner_;
  const PlyPosition& position_;
};

/// The numbers of a binary PLY file.
class PlyBinary {
  /// Calls `f` with a number of the C++ type for a type of PLY.
  template <typename F>
  static auto withType(PlyType type, const F& f) {
    switch (type) {
      case PlyType::int8:
        return f(std::int8_t{});
      case PlyType::uint8:
        return f(std::uint8_t{});
      case PlyType::int16:
        return f(std::int16_t{});
      case PlyType::uint16:
        return f(std::uint16_t{});
      case PlyType::int32:
        return f(std::int32_t{});
      case PlyType::uint32:
        return f(std::uint32_t{});
      case PlyType::float32:
        return f(float{});
      default:
        return f(double{});
    }
  }

 public:
  PlyBinary(Input& input, const PlyHeader& header, const PlyPosition& position)
      : input_(input),
        position_(position),
        isSwapped_((header.format == PlyHeader::Format::bigEndian) != (std::endian::native == std::endian::big)) {}

  std::uint64_t leastBytes(const PlyElement& element) const { return element.leastBytes(); }
  std::uint64_t line() const { return 0; }
  bool isAtEnd() { return !input_.ensure(1); }

  double number(PlyType type) {
    return withType(type, [&](auto kind) { return double(next<decltype(kind)>()); });
  }

  std::int64_t count(PlyType type) { return whole(type); }

  void skip(PlyType type, std::uint64_t numbers) {
    for (std::uint64_t bytes = numbers * sizeOf(type); bytes > 0;) {
      const std::size_t piece = std::size_t(std::min<std::uint64_t>(bytes, Input::kLongestPiece));
      require(piece);
      input_.skip(piece);
      bytes -= piece;
    }
  }

  template <typename Take>
  void items(PlyType type, std::uint64_t count, const Take& take) {
    withType(type, [&](auto kind) {
      using T = decltype(kind);
      while (count > 0) {
        const std::size_t piece = std::size_t(std::min<std::uint64_t>(count, Input::kLongestPiece / sizeof(T)));
        require(piece * sizeof(T));
        const char* const bytes = input_.rest().data();
        for (std::size_t i = 0; i < piece; ++i) take(wholeOf(load<T>(bytes + i * sizeof(T))));
        input_.skip(piece * sizeof(T));
        count -= piece;
      }
      return 0;
    });
  }

  void endElement() {}

  [[noreturn]] void refuse(const std::string& problem) const {
    input_.refuse(problem + " (byte " + std::to_string(input_.offset()) + "); check or export the file again");
  }

 private:
  void require(std::size_t bytes) {
    if (!input_.ensure(bytes)) refuseEnd();
  }

  [[noreturn]] void refuseEnd() const { refuse("the file ends at " + position_.text()); }

  template <typename T>
  T load(const char* from) const {
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), from, sizeof(T));
    if (isSwapped_) std::ranges::reverse(bytes);
    return std::bit_cast<T>(bytes);
  }

  template <typename T>
  T next() {
    require(sizeof(T));
    const T number = load<T>(input_.rest().data());
    input_.skip(sizeof(T));
    return number;
  }

  std::int64_t whole(PlyType type) {
    return withType(type, [&](auto kind) { return wholeOf(next<decltype(kind)>()); });
  }

  template <typename T>
  std::int64_t wholeOf(T number) const {
    if constexpr (std::is_floating_point_v<T>)
      if (!isWholeNumber(double(number))) refuse("an index is no whole number");
    return std::int64_t(number);
  }

  Input& input_;
  const PlyPosition& position_;
  bool isSwapped_;
};

/// Reads the elements of a PLY file, whose numbers are `PlyText` or `PlyBinary`.
template <typename Numbers>
class PlyElements {
 public:
  PlyElements(Input& input, const PlyHeader& header)
      : header_(header), numbers_(input, header, position_), builder_(input) {}

  TriangleMesh read() {
    for (const PlyElement& element : header_.elements) {
      position_ = {&element};
      if (element.properties.empty()) continue;
      if (element.name == "vertex") {
        readVertices(element);
      } else if (element.name == "face") {
        readFaces(element);
      } else if (element.name == "tristrips") {
        readStrips(element);
      } else {
        forEach(element, [&] { skip(element.properties); });
      }
    }
    if (!numbers_.isAtEnd()) numbers_.refuse("the file goes on behind the elements that its header promises");
    return builder_.finish();
  }

 private:
  template <typename Read>
  void forEach(const PlyElement& element, const Read& read) {
    for (position_.index = 0; position_.index < element.count; ++position_.index) {
      read();
      numbers_.endElement();
    }
  }

  void skip(std::span<const PlyProperty> properties) {
    for (const PlyProperty& property : properties)
      numbers_.skip(property.type, property.count ? lengthOf(property) : 1);
  }

  std::uint64_t lengthOf(const PlyProperty& list) {
    const std::int64_t length = numbers_.count(*list.count);
    if (length < 0) numbers_.refuse("a list of " + std::to_string(length) + " items at " + position_.text());
    return std::uint64_t(length);
  }

  std::size_t require(const PlyElement& element, const std::string& name, bool isList) {
    const auto found = element.find(name);
    if (!found || element.properties[*found].count.has_value() != isList)
      numbers_.refuse("the element '" + element.name + "' has no " + (isList ? "list '" : "number '") + name + "'");
    return *found;
  }

  void readVertices(const PlyElement& element) {
    const std::array<std::size_t, 3> axes = {require(element, "x", false), require(element, "y", false),
                                             require(element, "z", false)};
    std::vector<int> axisOf(element.properties.size(), -1);
    for (std::size_t axis = 0; axis < 3; ++axis) axisOf[axes[axis]] = int(axis);
    builder_.expectVertices(element.count, numbers_.leastBytes(element));
    forEach(element, [&] {
      Vector3 v;
      for (std::size_t p = 0; p < axisOf.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        if (axisOf[p] < 0)
          skip({&property, 1});
        else
          v[axisOf[p]] = numbers_.number(property.type);
      }
      if (!v.allFinite()) numbers_.refuse("a coordinate is not a finite number, at " + position_.text());
      builder_.addVertex(v);
    });
  }

  /// Returns a vertex index of the file as the builder takes it.
  std::uint32_t vertexOf(std::int64_t index) {
    if (index < 0) builder_.refuseNegative(index, numbers_.line());
    if (index > std::numeric_limits<std::uint32_t>::max()) builder_.refuseVertex(index + 1, numbers_.line());
    return std::uint32_t(index);
  }

  /// Calls read(list, length) for the list of vertex indices of each element, behind its length.
  template <typename Read>
  void forEachList(const PlyElement& element, const Read& read) {
    const std::size_t list = require(element, element.find("vertex_index") ? "vertex_index" : "vertex_indices", true);
    const std::span<const PlyProperty> properties = element.properties;
    forEach(element, [&] {
      skip(properties.first(list));
      read(properties[list], lengthOf(properties[list]));
      skip(properties.subspan(list + 1));
    });
  }

  void readFaces(const PlyElement& element) {
    builder_.expectTriangles(element.count, numbers_.leastBytes(element));
    std::vector<std::uint32_t> corners;
    forEachList(element, [&](const PlyProperty& list, std::uint64_t length) {
      if (length == 3) {
        Triangle triangle;
        auto corner = triangle.begin();
        numbers_.items(list.type, length, [&](std::int64_t index) { *corner++ = vertexOf(index); });
        builder_.addTriangle(triangle, numbers_.line());
      } else {
        corners.clear();
        numbers_.items(list.type, length, [&](std::int64_t index) { corners.push_back(vertexOf(index)); });
        builder_.addFace(corners, numbers_.line());
      }
    });
  }

  void readStrips(const PlyElement& element) {
    forEachList(element, [&](const PlyProperty& list, std::uint64_t length) {
      Strip strip;
      numbers_.items(list.type, length, [&](std::int64_t index) {
        if (index < 0)
          strip = {};
        else
          add(strip, vertexOf(index));
      });
    });
  }

  /// The part of a triangle strip that has been read: how many corners it has, and the last two of them.
  struct Strip {
    std::uint64_t corners = 0;
    std::uint32_t beforeLast = 0, last = 0;
  };

  /// Adds the triangle that a further corner of a strip makes with the last two. Every second triangle is turned.
  /// Triangles with equal corners lead from one place to another, and are no faces.
  void add(Strip& strip, std::uint32_t corner) {
    const auto [corners, a, b] = strip;
    if (corners >= 2 && a != b && b != corner && corner != a) {
      corners % 2 == 0 ? builder_.addTriangle({a, b, corner}, numbers_.line())
                       : builder_.addTriangle({b, a, corner}, numbers_.line());
    }
    strip = {corners + 1, b, corner};
  }

  const PlyHeader& header_;
  PlyPosition position_;
  Numbers numbers_;
  MeshBuilder builder_;
};

}  // namespace

TriangleMesh readPly(Input& input) {
  const PlyHeader header = readPlyHeader(input);
  if (header.format == PlyHeader::Format::ascii) return PlyElements<PlyText>(input, header).read();
  return PlyElements<PlyBinary>(input, header).read();
}

}  // namespace hpsdf::mesh
