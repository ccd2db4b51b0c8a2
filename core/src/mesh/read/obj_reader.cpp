#include "mesh/read/obj_reader.h"

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/scan/mesh_builder.h"
#include "mesh/scan/text_scanner.h"
#include "mesh/scan/word_text.h"

namespace hpsdf::mesh {
namespace {

class ObjReader {
 public:
  explicit ObjReader(Input& input) : text_(input, '#'), builder_(input) { text_.joinLinesAt('\\'); }

  TriangleMesh read() {
    while (text_.toWord()) {
      const std::string_view keyword = text_.word();
      if (keyword == "v") {
        readVertex();
      } else if (keyword == "f") {
        readFace();
      }
      text_.skipLine();
    }
    return builder_.finish();
  }

 private:
  void readVertex() {
    Vector3 v;
    for (double& x : v) {
      if (text_.atLineEnd()) text_.refuse("a vertex with fewer than three coordinates");
      x = text_.number();
    }
    builder_.addVertex(v);
  }

  void readFace() {
    const std::uint64_t line = text_.line();
    corners_.clear();
    while (!text_.atLineEnd()) {
      corners_.push_back(vertexOf(text_.wholeNumberBefore("the number of a vertex"), line));
      skipFurtherIndices();
    }
    builder_.addFace(corners_, line);
  }

  /// Skips the numbers of the texture coordinate and of the normal, as in 1/2/3, 1//3 or 1/2.
  void skipFurtherIndices() {
    for (int i = 0; i < 2 && text_.take('/'); ++i)
      if (!text_.endsWord() && !text_.isNext('/'))
        text_.wholeNumberBefore("the number of a normal or texture coordinate");
    if (!text_.endsWord()) text_.refuse("'" + wordText(text_.word()) + "' follows the numbers of a corner");
  }

  /// Returns the index of a vertex from 0.
  std::uint32_t vertexOf(std::int64_t number, std::uint64_t line) const {
    const std::int64_t index = number < 0 ? std::int64_t(builder_.vertices()) + number : number - 1;
    if (index < 0 || index > std::numeric_limits<std::uint32_t>::max()) builder_.refuseVertex(number, line);
    return std::uint32_t(index);
  }

  TextScanner text_;
  MeshBuilder builder_;
  std::vector<std::uint32_t> corners_;
};

}  // namespace

TriangleMesh readObj(Input& input) { return ObjReader(input).read(); }

}  // namespace hpsdf::mesh
