#include "hpsdf/mesh_file.h"

#include <array>
#include <bit>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "hpsdf/detail/output_file.h"
#include "hpsdf/detail/text.h"
#include "hpsdf/error.h"
#include "hpsdf/shapes.h"
#include "mesh/read/ply_reader.h"
#include "mesh/read/read_mesh.h"
#include "mesh/scan/input.h"

namespace hpsdf {
namespace {

namespace fs = std::filesystem;

/// Returns true for a PLY file and false for an OBJ file; throws `Error` for other extensions.
bool isPly(const std::filesystem::path& file) {
  const std::string extension = lowerExtension(file);
  if (extension != ".obj" && extension != ".ply")
    throw Error(ErrorKind::file, file.string(), "meshes are written as .obj or .ply; give a name that ends so");
  return extension == ".ply";
}

static_assert(std::endian::native == std::endian::little, "a PLY file is written as its numbers are in memory");

constexpr std::size_t kPiece = 1 << 16;  ///< bytes written at a time

/// Appends the shortest decimal text from which the same number is read back.
void append(std::string& text, double number) {
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  text.append(digits.data(), end);
}

void writeObj(const TriangleMesh& mesh, OutputFile& out) {
  std::string text;
  const auto writeIf = [&](bool full) {
    if (!full) return;
    out.write(text);
    text.clear();
  };
  for (const Vector3& v : mesh.vertices) {
    text += 'v';
    for (const double x : v) append(text += ' ', x);
    text += '\n';
    writeIf(text.size() >= kPiece);
  }
  for (const auto& triangle : mesh.triangles) {
    text += 'f';
    for (const std::uint32_t v : triangle) text += ' ' + std::to_string(std::uint64_t{v} + 1);
    text += '\n';
    writeIf(text.size() >= kPiece);
  }
  writeIf(!text.empty());
}

}  // namespace

bool isMeshFileName(const fs::path& file) { return mesh::hasMeshExtension(file); }

ImportedMesh importMesh(const fs::path& file, const Progress& progress) {
  ImportedMesh result = cleaned(mesh::readMesh(file, progress));
  result.mesh.name = file.filename().string();
  return result;
}

TriangleMesh loadMesh(const std::string& fileOrShape, const Progress& progress) {
  if (fileOrShape.starts_with("builtin:")) return shapes::mesh(fileOrShape);
  if (fileOrShape.starts_with("analytic:"))
    throw Error(ErrorKind::option, fileOrShape,
                "a mesh is expected here; use builtin:" + fileOrShape.substr(9) + " or a mesh file");
  return importMesh(fileOrShape, progress).mesh;
}

void checkMeshWritable(const std::filesystem::path& file) {
  isPly(file);
  checkWritable(file);
}

void saveMesh(const TriangleMesh& mesh, const std::filesystem::path& file) {
  const bool ply = isPly(file);
  OutputFile out(file);
  ply ? writePly(mesh, [&](std::span<const std::byte> bytes) { out.write(bytes); }) : writeObj(mesh, out);
  out.commit();
}

bool isReadByOthers(const fs::path& file) { return mesh::isReadByOthers(file); }

TriangleMesh readMesh(const fs::path& file, const Progress& progress) { return mesh::readMesh(file, progress); }

TriangleMesh readPly(std::string_view bytes, const std::string& name, const Progress& progress) {
  mesh::Input input(bytes, name, progress);
  return mesh::readPly(input);
}

void writePly(const TriangleMesh& mesh, const std::function<void(std::span<const std::byte>)>& write) {
  static_assert(sizeof(Vector3) == 3 * sizeof(double));
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(mesh.vertices.size()) +
      "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
      std::to_string(mesh.triangles.size()) + "\nproperty list uchar uint vertex_indices\nend_header\n";
  write(std::as_bytes(std::span(header)));
  write(std::as_bytes(std::span(mesh.vertices)));
  std::vector<std::byte> faces;
  faces.reserve(kPiece);
  for (const auto& triangle : mesh.triangles) {
    const auto corners = std::as_bytes(std::span(triangle));
    faces.push_back(std::byte{3});
    faces.insert(faces.end(), corners.begin(), corners.end());
    if (faces.size() + sizeof(triangle) < kPiece) continue;
    write(faces);
    faces.clear();
  }
  write(faces);
}

}  // namespace hpsdf
