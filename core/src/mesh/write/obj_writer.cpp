#include <array>
#include <charconv>
#include <cstdint>

#include "mesh/write/mesh_writer.h"

namespace hpsdf::mesh {
namespace {

/// Adds the shortest decimal text from which the same number is read back, after a blank.
template <typename Number>
void addDecimal(ByteStream& out, Number number) {
  std::array<char, 32> digits;
  digits[0] = ' ';
  const auto end = std::to_chars(digits.data() + 1, digits.data() + digits.size(), number).ptr;
  out.add({digits.data(), end});
}

}  // namespace

void writeObj(const TriangleMesh& mesh, const VertexData& data, const WriteBytes& write) {
  ByteStream out(write);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    out.add("v");
    for (const double x : mesh.vertices[i]) addDecimal(out, x);
    // Colours behind the position, 0 to 1, are an extension that MeshLab, Blender and others read.
    if (!data.colors.empty())
      for (const std::uint8_t channel : data.colors[i]) addDecimal(out, static_cast<float>(channel) / 255);
    out.add("\n");
  }
  for (const Vector3& normal : data.normals) {
    out.add("vn");
    for (const double x : normal) addDecimal(out, static_cast<float>(x));
    out.add("\n");
  }
  for (const Triangle& triangle : mesh.triangles) {
    out.add("f");
    for (const std::uint32_t v : triangle) {
      const std::uint64_t number = std::uint64_t{v} + 1;
      addDecimal(out, number);
      if (!data.normals.empty()) out.add("//" + std::to_string(number));
    }
    out.add("\n");
  }
  out.finish();
}

}  // namespace hpsdf::mesh
