#include "mesh/read/off_reader.h"

#include <cctype>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/scan/mesh_builder.h"
#include "mesh/scan/text_scanner.h"
#include "mesh/scan/word_text.h"

namespace hpsdf::mesh {
namespace {

/// Removes a beginning from a text. Returns false if the text begins otherwise.
bool take(std::string_view& text, std::string_view beginning) {
  if (!text.starts_with(beginning)) return false;
  text.remove_prefix(beginning.size());
  return true;
}

/// Reads the keyword, which may be missing: then the file begins with its counts. Returns true if vertices have
/// normals, colours or texture coordinates behind their coordinates.
bool readKeyword(TextScanner& text) {
  if (!text.toWord()) text.refuse("the file holds nothing but blanks and comments");
  const char first = text.input().rest().front();
  if (std::isdigit(static_cast<unsigned char>(first)) && !text.input().rest().starts_with("4OFF")) return false;
  const std::string keyword(text.word());
  std::string_view rest = keyword;
  bool hasMore = false;
  while (take(rest, "ST") || take(rest, "C") || take(rest, "N")) hasMore = true;  // in any order, as files have it
  if (rest == "4OFF" || rest == "nOFF" || rest == "4nOFF")
    text.refuse("'" + keyword + "' has vertices of another dimension than 3");
  if (rest != "OFF") text.refuse("expected 'OFF' (or COFF, NOFF, STOFF, …), found '" + wordText(keyword) + "'");
  if (!text.atLineEnd() && text.input().rest().starts_with("BINARY"))
    text.refuse("binary OFF files are not read: export it as text, or as PLY");
  return hasMore;
}

/// Returns a count of the header.
std::uint64_t readCount(TextScanner& text, const std::string& what) {
  const std::int64_t count = text.wholeNumber("the number of " + what);
  if (count < 0) text.refuse(std::to_string(count) + " is no number of " + what);
  return std::uint64_t(count);
}

/// Throws `Error` if the file ends before the item with this index, of so many that its header promises.
void requireMore(TextScanner& text, const char* what, std::uint64_t index, std::uint64_t count) {
  if (!text.toWord())
    text.refuse(std::string("the file ends at ") + what + " " + std::to_string(index + 1) + " of " +
                std::to_string(count));
}

void readVertices(TextScanner& text, std::uint64_t count, bool hasMore, MeshBuilder& builder) {
  constexpr std::uint64_t kLeastBytes = 6;  // "0 0 0" and a blank
  builder.expectVertices(count, kLeastBytes);
  for (std::uint64_t i = 0; i < count; ++i) {
    requireMore(text, "vertex", i, count);
    builder.addVertex(text.vector("a vertex"));
    if (hasMore) text.skipLine();
  }
}

void readFaces(TextScanner& text, std::uint64_t count, MeshBuilder& builder) {
  constexpr std::uint64_t kLeastBytes = 2;  // "0" and a blank
  builder.expectTriangles(count, kLeastBytes);
  std::vector<std::uint32_t> corners;
  for (std::uint64_t i = 0; i < count; ++i) {
    requireMore(text, "face", i, count);
    const std::int64_t length = text.wholeNumber("the number of a face's corners");
    if (length < 0) text.refuse("a face with " + std::to_string(length) + " corners");
    corners.clear();
    for (std::int64_t c = 0; c < length; ++c) {
      const std::int64_t index = text.wholeNumber("a corner of a face");
      if (index < 0) builder.refuseNegative(index, text.line());
      if (index >= std::int64_t(builder.vertices())) builder.refuseVertex(index + 1, text.line());
      corners.push_back(std::uint32_t(index));
    }
    builder.addFace(corners, text.line());
    text.skipLine();
  }
}

}  // namespace

TriangleMesh readOff(Input& input) {
  TextScanner text(input, '#');
  const bool hasMore = readKeyword(text);
  const std::uint64_t vertices = readCount(text, "vertices"), faces = readCount(text, "faces");
  readCount(text, "edges");  // It is often wrong, and nothing depends on it.
  MeshBuilder builder(input);
  readVertices(text, vertices, hasMore, builder);
  readFaces(text, faces, builder);
  if (text.toWord())
    text.refuse("the file goes on behind the " + std::to_string(faces) + " faces that it promises" +
                (hasMore ? "" : " (with colours or normals of vertices, it must begin with COFF or NOFF)"));
  return builder.finish();
}

}  // namespace hpsdf::mesh
