#include <array>
#include <cstdint>
#include <string>

#include "mesh/write/mesh_writer.h"
#include "util/number_text.h"

namespace hpsdf::mesh {
namespace {

/// Returns a line of a word and numbers, without its end.
template <typename Numbers>
std::string lineOf(const char* word, const Numbers& numbers) {
  std::string line = word;
  for (const auto number : numbers) detail::appendNumber(line += ' ', number);
  return line;
}

}  // namespace

void writeObj(const TriangleMesh& mesh, const VertexData& data, const WriteBytes& write) {
  ByteStream out(write);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    std::string line = lineOf("v", mesh.vertices[i]);
    // Colours behind the position, 0 to 1, are an extension that MeshLab, Blender and others read.
    if (!data.colors.empty())
      for (const std::uint8_t channel : data.colors[i])
        detail::appendNumber(line += ' ', static_cast<float>(channel) / 255);
    out.add(line += '\n');
  }
  for (const Vector3& normal : data.normals)
    out.add(lineOf("vn", std::array{float(normal[0]), float(normal[1]), float(normal[2])}) + '\n');
  for (const Triangle& triangle : mesh.triangles) {
    std::string line = "f";
    for (const std::uint32_t v : triangle) {
      const std::uint64_t number = std::uint64_t{v} + 1;
      detail::appendNumber(line += ' ', number);
      if (!data.normals.empty()) detail::appendNumber(line += "//", number);
    }
    out.add(line += '\n');
  }
  out.finish();
}

}  // namespace hpsdf::mesh
