#include "mesh/read/stl_reader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "hpsdf/detail/text.h"
#include "mesh/scan/mesh_builder.h"
#include "mesh/scan/text_scanner.h"
#include "mesh/scan/word_text.h"

namespace hpsdf::mesh {
namespace {

static_assert(std::endian::native == std::endian::little, "binary STL files are little-endian");

constexpr std::size_t kHeader = 80, kFace = 50;  ///< bytes of a binary file

/// Adds a triangle with vertices of its own.
void addFace(MeshBuilder& builder, const std::array<Vector3, 3>& corners, std::uint64_t line) {
  const auto first = std::uint32_t(builder.vertices());
  for (const Vector3& corner : corners) builder.addVertex(corner);
  builder.addTriangle({first, first + 1, first + 2}, line);
}

/// Returns the number of faces that a binary file promises, or 0 if the file is too short for one.
std::uint32_t promisedFaces(Input& input) {
  std::uint32_t faces = 0;
  if (input.ensure(kHeader + sizeof faces)) std::memcpy(&faces, input.rest().data() + kHeader, sizeof faces);
  return faces;
}

/// Returns true if the file is text: if it begins with "solid", and holds no binary data soon after.
bool isText(Input& input) {
  constexpr std::size_t kSoon = 8192;
  input.ensure(kSoon);
  const std::string beginning = lowerCase(std::string(input.rest().substr(0, kSoon)));
  if (!trimmed(beginning).starts_with("solid") && !beginning.starts_with("\xef\xbb\xbfsolid")) return false;
  const auto isBinary = [](char c) { return c >= '\0' && c < ' ' && !(c >= '\t' && c <= '\r'); };
  return std::ranges::none_of(beginning, isBinary);
}

Vector3 corner(const char* bytes) {
  std::array<float, 3> v;
  std::memcpy(v.data(), bytes, sizeof v);
  return {v[0], v[1], v[2]};
}

TriangleMesh readBinary(Input& input) {
  const std::uint64_t faces = promisedFaces(input);
  if (input.rest().size() < kHeader + sizeof(std::uint32_t))
    input.refuse("neither a binary nor a text STL file: it does not begin with 'solid', and is too short for a header");
  input.skip(kHeader + sizeof(std::uint32_t));
  if (faces > input.mostLeft() / kFace)
    input.refuse("it promises " + std::to_string(faces) + " faces of 50 bytes, but only " +
                 std::to_string(input.mostLeft()) + " bytes follow; check or export the file again");
  MeshBuilder builder(input);
  builder.expectVertices(3 * faces, 1);
  builder.expectTriangles(faces, kFace);
  for (std::uint64_t f = 0; f < faces; ++f) {
    const auto where = [&] { return "face " + std::to_string(f + 1) + " of " + std::to_string(faces); };
    if (!input.ensure(kFace)) input.refuse("the file ends at " + where() + "; check or export the file again");
    const char* const face = input.rest().data() + sizeof(float) * 3;  // the normal comes first
    const std::array<Vector3, 3> corners = {corner(face), corner(face + 12), corner(face + 24)};
    for (const Vector3& v : corners)
      if (!v.allFinite())
        input.refuse("a coordinate is not a finite number, in " + where() + "; check or export the file again");
    addFace(builder, corners, 0);
    input.skip(kFace);
  }
  if (input.ensure(1))
    input.refuse("the file goes on behind the " + std::to_string(faces) +
                 " faces that it promises; check or export the file again");
  return builder.finish();
}

/// Reads the faces of STL files that are text.
class StlText {
 public:
  explicit StlText(Input& input) : text_(input, '\0'), builder_(input) {}

  TriangleMesh read() {
    while (text_.toWord()) {
      expect("solid");
      text_.skipLine();  // the name of the solid
      while (!takeEnd()) readFace();
    }
    return builder_.finish();
  }

 private:
  /// Reads the next word into `word_`, in lower case.
  const std::string& next(std::string_view expected) {
    if (!text_.toWord()) text_.refuse("expected '" + std::string(expected) + "', but the file ends");
    word_ = text_.word();
    if (word_ != expected) word_ = lowerCase(word_);
    return word_;
  }

  void expect(std::string_view expected) {
    if (next(expected) != expected) refuseWord(expected);
  }

  [[noreturn]] void refuseWord(std::string_view expected) {
    text_.refuse("expected '" + std::string(expected) + "', found '" + wordText(word_) + "'");
  }

  /// Reads `endsolid` with the name behind it, or `facet`. Returns false for `facet`.
  bool takeEnd() {
    next("facet");
    if (word_ == "facet") return false;
    if (word_ != "endsolid" && word_ != "end") refuseWord("facet' or 'endsolid");
    text_.skipLine();
    return true;
  }

  /// Reads a face behind the word `facet`. Its normal is skipped; it may be anything, and missing.
  void readFace() {
    while (next("outer") != "outer") {
      if (word_ == "vertex" || word_ == "facet" || word_ == "endfacet") refuseWord("outer");
    }
    expect("loop");
    std::array<Vector3, 3> corners;
    for (Vector3& v : corners) {
      expect("vertex");
      v = text_.vector("a vertex");
    }
    expect("endloop");
    expect("endfacet");
    addFace(builder_, corners, text_.line());
  }

  TextScanner text_;
  MeshBuilder builder_;
  std::string word_;
};

}  // namespace

TriangleMesh readStl(Input& input) {
  const std::uint64_t faces = promisedFaces(input);
  const bool hasBinaryLength = input.mostLeft() == kHeader + sizeof(std::uint32_t) + faces * kFace;
  return !hasBinaryLength && isText(input) ? StlText(input).read() : readBinary(input);
}

}  // namespace hpsdf::mesh
