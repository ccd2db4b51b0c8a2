#include "mesh/file/mesh_export.h"

#include <array>
#include <bit>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"

namespace hpsdf::mesh {
namespace {

static_assert(std::endian::native == std::endian::little, "a PLY file is written as its numbers are in memory");

constexpr std::size_t kPiece = 1 << 16;  ///< bytes of text written at a time

/// Appends the shortest text that reads as the same number.
void append(std::string& text, double number) {
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  text.append(digits.data(), end);
}

/// The syntax of a format for meshes as text.
struct TextForm {
  std::string_view beforeVertex, beforeFace;
  std::uint64_t firstVertex;  ///< number of the first vertex
};

void writeText(const TriangleMesh& mesh, const TextForm& form, OutputFile& out) {
  std::string text;
  const auto writeIf = [&](bool full) {
    if (!full) return;
    out.write(text);
    text.clear();
  };
  for (const Vector3& v : mesh.vertices) {
    text += form.beforeVertex;
    append(text, v.x());
    append(text += ' ', v.y());
    append(text += ' ', v.z());
    text += '\n';
    writeIf(text.size() >= kPiece);
  }
  for (const auto& triangle : mesh.triangles) {
    text += form.beforeFace;
    for (const std::uint32_t v : triangle) text += ' ' + std::to_string(form.firstVertex + v);
    text += '\n';
    writeIf(text.size() >= kPiece);
  }
  writeIf(!text.empty());
}

}  // namespace

void writeObj(const TriangleMesh& mesh, OutputFile& out) { writeText(mesh, {"v ", "f", 1}, out); }

void writePly(const TriangleMesh& mesh, OutputFile& out) {
  static_assert(sizeof(Vector3) == 3 * sizeof(double));
  const auto vertices = std::as_bytes(std::span(mesh.vertices));
  // assimp takes a line feed at the beginning of the data for a part of the header, and shifts all numbers by a byte.
  const bool asText = !vertices.empty() && vertices.front() == std::byte{'\n'};
  out.write(std::string("ply\nformat ") + (asText ? "ascii" : "binary_little_endian") + " 1.0\nelement vertex " +
            std::to_string(mesh.vertices.size()) +
            "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
            std::to_string(mesh.triangles.size()) + "\nproperty list uchar uint vertex_indices\nend_header\n");
  if (asText) return writeText(mesh, {"", "3", 0}, out);
  out.write(vertices);
  std::vector<std::byte> faces;
  for (const auto& triangle : mesh.triangles) {
    const auto corners = std::as_bytes(std::span(triangle));
    faces.push_back(std::byte{3});
    faces.insert(faces.end(), corners.begin(), corners.end());
  }
  out.write(faces);
}

}  // namespace hpsdf::mesh
