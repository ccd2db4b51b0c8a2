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

/// The word with which an OFF file begins.
struct OffKeyword {
  bool hasMore = false;  ///< vertices have normals, colours or texture coordinates behind their coordinates
};

/// Removes a beginning from a text. Returns false if the text begins otherwise.
bool take(std::string_view& text, std::string_view beginning) {
  if (!text.starts_with(beginning)) return false;
  text.remove_prefix(beginning.size());
  return true;
}

/// Reads the keyword, which may be missing: then the file begins with its counts.
OffKeyword readKeyword(TextScanner& text) {
  if (!text.toWord()) text.refuse("the file holds nothing but blanks and comments");
  const char first = text.input().rest().front();
  if (std::isdigit(static_cast<unsigned char>(first)) && !text.input().rest().starts_with("4OFF")) return {};
  const std::string keyword(text.word());
  std::string_view rest = keyword;
  OffKeyword result;
  while (take(rest, "ST") || take(rest, "C") || take(rest, "N"))
    result.hasMore = true;  // in any order, as files have it
  if (rest == "4OFF" || rest == "nOFF" || rest == "4nOFF")
    text.refuse("'" + keyword + "' has vertices of another dimension than 3");
  if (rest != "OFF") text.refuse("expected 'OFF' (or COFF, NOFF, STOFF, …), found '" + wordText(keyword) + "'");
  if (!text.atLineEnd() && text.input().rest().starts_with("BINARY"))
    text.refuse("binary OFF files are not read: export it as text, or as PLY");
  return result;
}

/// Returns a count of the header. `bytes` is the least number of bytes that each of the things takes in the file.
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

void readVertices(TextScanner& text, std::uint64_t count, const OffKeyword& keyword, MeshBuilder& builder) {
  constexpr std::uint64_t kLeastBytes = 6;  // "0 0 0" and a blank
  builder.expectVertices(count, kLeastBytes);
  for (std::uint64_t i = 0; i < count; ++i) {
    requireMore(text, "vertex", i, count);
    builder.addVertex(text.vector("a vertex"));
    if (keyword.hasMore) text.skipLine();
  }
  if (count > 0 && !keyword.hasMore && !text.atLineEnd())
    text.refuse(
        "more numbers than the coordinates of the vertices: with colours or normals, the file begins with COFF "
        "or NOFF");
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
      if (index < 0 || index >= std::int64_t(builder.vertices())) builder.refuseVertex(index + 1, text.line());
      corners.push_back(std::uint32_t(index));
    }
    builder.addFace(corners, text.line());
    text.skipLine();
  }
}

}  // namespace

TriangleMesh readOff(Input& input) {
  TextScanner text(input, '#');
  const OffKeyword keyword = readKeyword(text);
  const std::uint64_t vertices = readCount(text, "vertices"), faces = readCount(text, "faces");
  readCount(text, "edges");  // It is often wrong, and nothing depends on it.
  MeshBuilder builder(input);
  readVertices(text, vertices, keyword, builder);
  readFaces(text, faces, builder);
  if (text.toWord()) text.refuse("the file goes on behind the " + std::to_string(faces) + " faces that it promises");
  return builder.finish();
}

}  // namespace hpsdf::mesh
