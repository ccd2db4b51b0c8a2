#include "mesh/file/assimp_import.h"

#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "hpsdf/detail/text.h"
#include "hpsdf/error.h"
#include "mesh/file/triangulate.h"

namespace hpsdf::mesh {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 7> kExtensions = {".obj", ".ply", ".stl", ".off", ".3ds", ".gltf", ".glb"};

/// Throws `Error` if a mesh file can be recognised as unusable before assimp opens it, because assimp's own
/// messages for such files do not help the user.
void requireReadable(const fs::path& file) {
  const std::string name = file.string();
  const auto refuse = [&](const std::string& problem) { throw Error(ErrorKind::file, name, problem); };
  if (name.empty()) refuse("the mesh file's name is empty; give a file name");
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (status.type() == fs::file_type::not_found) refuse("no such file; check the path");
  if (!fs::exists(status)) refuse("cannot be read (" + error.message() + "); check the path");
  if (fs::is_directory(status)) refuse("a directory, not a file; name a mesh file in it");
  if (!fs::is_regular_file(status)) refuse("not a regular file; name a mesh file");

  const std::string extension = lowerExtension(file);
  if (!hasKnownExtension(file)) {
    std::string known;
    for (const std::string_view e : kExtensions) known += (known.empty() ? "" : ", ") + std::string(e);
    refuse((extension.empty() ? "no extension" : "unknown format " + extension) + "; a mesh file ends in one of " +
           known);
  }

  const std::uintmax_t size = fs::file_size(file, error);
  if (!error && size == 0) refuse("the file is empty; export the mesh again");
  std::ifstream stream(file, std::ios::binary);
  if (!stream || stream.peek() == std::ifstream::traits_type::eof()) refuse("cannot be read; check its permissions");
}

constexpr std::size_t kMostHeaderLines = 1000;

/// Returns the lines of a PLY file's header.
std::vector<std::string> plyHeader(const fs::path& file) {
  std::vector<std::string> lines;
  std::ifstream stream(file, std::ios::binary);
  for (std::string line; lines.size() < kMostHeaderLines && std::getline(stream, line);) {
    if (line.starts_with("end_header")) break;
    lines.push_back(line);
  }
  return lines;
}

double largestPlyCount(const fs::path& file) {
  double largest = 0;
  for (const std::string& line : plyHeader(file)) {
    std::istringstream words(line);
    std::string keyword, name;
    double count = 0;
    if (words >> keyword >> name >> count && keyword == "element") largest = std::max(largest, count);
  }
  return largest;
}

/// Returns the larger of the vertex count and the face count in the header of an OFF file. The edge count in the
/// header is ignored, because it is often wrong and no reader uses it.
double largestOffCount(const fs::path& file) {
  double largest = 0;
  std::ifstream stream(file, std::ios::binary);
  std::string line;
  for (std::size_t i = 0; i < kMostHeaderLines && largest == 0 && std::getline(stream, line); ++i) {
    line = line.substr(0, line.find('#'));
    if (const std::size_t keyword = line.find("OFF"); keyword != std::string::npos) line.erase(0, keyword + 3);
    std::istringstream words(line);
    double vertices = 0, faces = 0;
    words >> vertices >> faces;
    largest = std::max(vertices, faces);
  }
  return largest;
}

/// Returns true for a PLY file that holds coordinates as text or as doubles.
bool plyMayExceedFloat(const fs::path& file) {
  return std::ranges::any_of(plyHeader(file), [](const std::string& line) {
    std::istringstream words(line);
    std::string keyword, kind, name;
    words >> keyword >> kind >> name;
    return (keyword == "format" && kind == "ascii") ||
           (keyword == "property" && name == "x" && kind != "float" && kind != "float32");
  });
}

/// Returns true if an STL file has exactly the size of a binary file with as many faces as its header says. assimp
/// recognises binary STL files by the same test.
bool isBinaryStl(const fs::path& file) {
  constexpr std::uintmax_t kHeader = 80, kFace = 50;
  std::uint32_t faces = 0;
  std::ifstream stream(file, std::ios::binary);
  stream.seekg(kHeader);
  std::error_code error;
  return stream.read(reinterpret_cast<char*>(&faces), sizeof faces) &&
         fs::file_size(file, error) == kHeader + sizeof faces + kFace * faces;
}

/// Returns true if a line of the text consists of `line` and blanks only. Lines may end with \r, \n or both.
bool hasLine(std::string_view text, std::string_view line) {
  constexpr std::string_view kBlank = " \t", kLineEnd = "\r\n";
  for (std::size_t at = 0; (at = text.find(line, at)) != std::string_view::npos; at += line.size()) {
    const std::size_t before = text.substr(0, at).find_last_not_of(kBlank);
    const std::size_t after = text.find_first_not_of(kBlank, at + line.size());
    const auto ends = [&](std::size_t i) { return i == text.npos || kLineEnd.find(text[i]) != kLineEnd.npos; };
    if (ends(before) && ends(after)) return true;
  }
  return false;
}

/// Throws `Error` if the file's header would make assimp search without end or allocate far too much memory.
void requireSoundHeader(const fs::path& file) {
  const std::string extension = lowerExtension(file), name = file.string();
  if (extension == ".ply") {
    // Limit the length of a PLY header, because assimp reads on until it finds the header's end, however long
    // that takes.
    constexpr std::size_t kLongestHeader = 1 << 20;
    std::string beginning(kLongestHeader, '\0');
    std::ifstream stream(file, std::ios::binary);
    stream.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
    beginning.resize(static_cast<std::size_t>(stream.gcount()));
    if (!hasLine(beginning, "end_header"))
      throw Error(ErrorKind::file, name, "its header does not end; check or export the file again");
  }
  // Check the largest element count in the header. assimp allocates memory for that many elements before it reads
  // them, so that a few wrong bytes could exhaust the memory.
  const double count = extension == ".ply" ? largestPlyCount(file) : extension == ".off" ? largestOffCount(file) : 0;
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (!error && count > static_cast<double>(size))
    throw Error(ErrorKind::file, name,
                "its header promises more vertices or faces than the file has bytes; export it again");
}

/// Returns an error message of assimp as a single line.
std::string oneLine(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return std::iscntrl(c); }, ' ');
  text.erase(text.find_last_not_of(" .") + 1);
  return text.empty() ? "unknown reason" : text;
}

Error unreadable(const std::string& name, const std::string& reason) {
  return {ErrorKind::file, name, "cannot be read as a mesh (" + oneLine(reason) + "); check or export the file again"};
}

/// Throws `Error` if a vertex index in the scene is out of range. assimp's readers check indices for some
/// formats only.
void requireValidIndices(const aiScene& scene, const std::string& name) {
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& part = *scene.mMeshes[m];
    for (unsigned f = 0; f < part.mNumFaces; ++f)
      for (unsigned i = 0; i < part.mFaces[f].mNumIndices; ++i)
        if (part.mFaces[f].mIndices[i] >= part.mNumVertices)
          throw Error(ErrorKind::mesh, name,
                      "face " + std::to_string(f + 1) + " of part " + std::to_string(m + 1) + " refers to vertex " +
                          std::to_string(std::uint64_t{part.mFaces[f].mIndices[i]} + 1) + ", but there are only " +
                          std::to_string(part.mNumVertices) + "; repair or export it again");
  }
}

/// Reads the scene in a file. The scene belongs to `importer`.
const aiScene& readScene(Assimp::Importer& importer, const fs::path& file) {
  const std::string name = file.string();
  const aiScene* scene = nullptr;
  try {
    scene = importer.ReadFile(name, 0);
  } catch (const std::exception& e) {
    throw unreadable(name, e.what());
  }
  if (!scene || !scene->mRootNode) throw unreadable(name, importer.GetErrorString());
  requireValidIndices(*scene, name);
  return *scene;
}

Eigen::Affine3d toEigen(const aiMatrix4x4& m) {
  Eigen::Affine3d result;
  result.matrix() << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, 0, 0, 0, 1;
  return result;
}

/// Triangulates a polygon of the mesh `part`. The triangles hold vertex indices of `part`. Returns no triangles if the
/// polygon is a point or a line.
std::vector<Triangle> trianglesOf(const aiFace& face, const aiMesh& part) {
  if (face.mNumIndices < 3) return {};
  std::vector<Vector3> corners;
  for (unsigned i = 0; i < face.mNumIndices; ++i) {
    const aiVector3D& p = part.mVertices[face.mIndices[i]];
    corners.emplace_back(p.x, p.y, p.z);
  }
  auto triangles = triangulate(corners);
  for (auto& triangle : triangles)
    for (std::uint32_t& v : triangle) v = face.mIndices[v];
  return triangles;
}

void append(TriangleMesh& mesh, const aiMesh& part, const Eigen::Affine3d& worldFromPart) {
  if (mesh.vertices.size() + part.mNumVertices > std::numeric_limits<std::uint32_t>::max())
    throw Error(ErrorKind::limit, mesh.name, "more than 4294967295 vertices; simplify the mesh first");
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (unsigned v = 0; v < part.mNumVertices; ++v) {
    const aiVector3D& p = part.mVertices[v];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
      throw Error(
          ErrorKind::mesh, mesh.name,
          "vertex " + std::to_string(std::size_t{first} + v + 1) +
              " has a coordinate that is not a finite number (or beyond 3.4e38, where float ends); repair the mesh, "
              "or scale it down, before it is exported again");
    mesh.vertices.push_back(worldFromPart * Vector3(p.x, p.y, p.z));
  }
  const bool mirrored = worldFromPart.linear().determinant() < 0;  // A reflection reverses all orientations.
  for (unsigned f = 0; f < part.mNumFaces; ++f)
    for (auto [a, b, c] : trianglesOf(part.mFaces[f], part)) {
      if (mirrored) std::swap(b, c);
      mesh.triangles.push_back({first + a, first + b, first + c});
    }
}

/// Joins all meshes of a scene in world coordinates. A mesh occurs once for every scene node that refers to it.
TriangleMesh joined(const aiScene& scene, const fs::path& file) {
  TriangleMesh mesh;
  mesh.name = file.string();
  Eigen::Affine3d worldFromRoot = Eigen::Affine3d::Identity();
  // Undo assimp's rotation of 3DS scenes from z-up to y-up, to restore the coordinates of the file.
  if (lowerExtension(file) == ".3ds") worldFromRoot.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;

  std::vector<std::pair<const aiNode*, Eigen::Affine3d>> pending = {{scene.mRootNode, worldFromRoot}};
  while (!pending.empty()) {
    const auto [node, worldFromParent] = pending.back();
    pending.pop_back();
    const Eigen::Affine3d worldFromNode = worldFromParent * toEigen(node->mTransformation);
    for (unsigned m = 0; m < node->mNumMeshes; ++m) append(mesh, *scene.mMeshes[node->mMeshes[m]], worldFromNode);
    for (unsigned c = node->mNumChildren; c-- > 0;) pending.emplace_back(node->mChildren[c], worldFromNode);
  }
  return mesh;
}

}  // namespace

TriangleMesh readByAssimp(const fs::path& file) {
  requireReadable(file);
  requireSoundHeader(file);
  Assimp::Importer importer;
  return joined(readScene(importer, file), file);
}

bool hasKnownExtension(const fs::path& file) {
  return std::ranges::find(kExtensions, lowerExtension(file)) != kExtensions.end();
}

bool mayExceedFloat(const fs::path& file) {
  const std::string extension = lowerExtension(file);
  if (extension == ".stl") return !isBinaryStl(file);
  return extension == ".obj" || extension == ".off" || (extension == ".ply" && plyMayExceedFloat(file));
}

}  // namespace hpsdf::mesh
