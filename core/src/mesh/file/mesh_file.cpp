#include "hpsdf/mesh_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "hpsdf/detail/output_file.h"
#include "hpsdf/detail/text.h"
#include "hpsdf/error.h"
#include "hpsdf/shapes.h"
#include "mesh/file/assimp_import.h"

namespace hpsdf {
namespace {

namespace fs = std::filesystem;

double largestCoordinate(const Box& box) { return box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff(); }

/// Returns the distance between adjacent `float` numbers near a coordinate.
double floatSpacing(double coordinate) {
  constexpr int kBits = std::numeric_limits<float>::digits, kSmallest = std::numeric_limits<float>::min_exponent;
  const int exponent = coordinate > 0 ? std::ilogb(coordinate) + 1 : kSmallest;
  return std::ldexp(1.0, std::max(exponent, kSmallest) - kBits);
}

/// Returns a hint for the error message about a mesh without area if rounding its coordinates to `float` is the
/// probable cause, else an empty text.
std::string spacingHint(const fs::path& file, const Box& box) {
  constexpr double kFew = 16;
  const double largest = largestCoordinate(box), spacing = floatSpacing(largest);
  if (!mesh::mayExceedFloat(file) || box.sizes().maxCoeff() > kFew * spacing) return "";
  std::ostringstream hint;
  hint.precision(2);
  hint << "; coordinates reach " << largest << ", where the reader keeps them " << spacing
       << " apart: scale the mesh, or move it nearer to the origin, before it is exported";
  return hint.str();
}

/// Returns true if any triangle has three different vertices. Only such a triangle can have lost its area by rounding.
bool hasThreeCorners(const TriangleMesh& mesh) {
  return std::ranges::any_of(mesh.triangles,
                             [](const auto& t) { return t[0] != t[1] && t[1] != t[2] && t[2] != t[0]; });
}

ImportedMesh cleaned(TriangleMesh mesh, const fs::path& file) {
  const Box box = boundingBox(mesh);
  const bool mayBeRounded = hasThreeCorners(mesh);
  try {
    return hpsdf::cleaned(std::move(mesh));
  } catch (const Error& error) {
    throw Error(error.kind(), error.subject(), error.problem() + (mayBeRounded ? spacingHint(file, box) : ""));
  }
}

/// Returns true for a PLY file and false for an OBJ file; throws `Error` for other extensions.
bool isPly(const std::filesystem::path& file) {
  const std::string extension = lowerExtension(file);
  if (extension != ".obj" && extension != ".ply")
    throw Error(ErrorKind::file, file.string(), "meshes are written as .obj or .ply; give a name that ends so");
  return extension == ".ply";
}

static_assert(std::endian::native == std::endian::little, "a PLY file is written as its numbers are in memory");

constexpr std::size_t kPiece = 1 << 16;  ///< bytes of text written at a time

/// Appends the shortest decimal text from which the same number is read back.
void append(std::string& text, double number) {
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  text.append(digits.data(), end);
}

/// The syntax of vertices and faces in a text format for meshes.
struct TextForm {
  std::string_view beforeVertex, beforeFace;
  std::uint64_t firstVertex;  ///< index of the first vertex in the format: 0 or 1
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

void writeObj(const TriangleMesh& mesh, OutputFile& out) { writeText(mesh, {"v ", "f", 1}, out); }

/// Writes a PLY file, as text if binary data would begin with a line feed, else as binary data.
void writePly(const TriangleMesh& mesh, OutputFile& out) {
  static_assert(sizeof(Vector3) == 3 * sizeof(double));
  const auto vertices = std::as_bytes(std::span(mesh.vertices));
  // Choose text if binary data would begin with a line feed. assimp takes that byte for a part of the header and
  // then reads all numbers shifted by one byte.
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

}  // namespace

double coordinateSpacing(const fs::path& file, const TriangleMesh& mesh) {
  const Box box = boundingBox(mesh);
  return box.isEmpty() || !mesh::mayExceedFloat(file) ? 0 : floatSpacing(largestCoordinate(box));
}

bool isMeshFileName(const fs::path& file) { return mesh::hasKnownExtension(file); }

ImportedMesh importMesh(const fs::path& file) {
  ImportedMesh result = cleaned(mesh::readByAssimp(file), file);
  result.mesh.name = file.filename().string();
  return result;
}

TriangleMesh loadMesh(const std::string& fileOrShape) {
  if (fileOrShape.starts_with("builtin:")) return shapes::mesh(fileOrShape);
  if (fileOrShape.starts_with("analytic:"))
    throw Error(ErrorKind::option, fileOrShape,
                "a mesh is expected here; use builtin:" + fileOrShape.substr(9) + " or a mesh file");
  return importMesh(fileOrShape).mesh;
}

void checkMeshWritable(const std::filesystem::path& file) {
  isPly(file);
  checkWritable(file);
}

void saveMesh(const TriangleMesh& mesh, const std::filesystem::path& file) {
  const bool ply = isPly(file);
  OutputFile out(file);
  ply ? writePly(mesh, out) : writeObj(mesh, out);
  out.commit();
}

}  // namespace hpsdf
