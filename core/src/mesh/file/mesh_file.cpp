#include "hpsdf/mesh_file.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
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
#include "mesh/write/mesh_writer.h"

namespace hpsdf {
namespace {

namespace fs = std::filesystem;

/// A format in which meshes are written.
struct WrittenFormat {
  const char* extension;
  bool isSingle;  ///< coordinates are single-precision numbers
  void (*write)(const TriangleMesh& mesh, const VertexData& data, const mesh::WriteBytes& write);
};

constexpr std::array kWrittenFormats = {
    WrittenFormat{".obj", false, mesh::writeObj},
    WrittenFormat{".ply", false, mesh::writePly},
    WrittenFormat{".stl", true,
                  [](const TriangleMesh& surface, const VertexData&, const mesh::WriteBytes& write) {
                    mesh::writeStl(surface, write);
                  }},
    WrittenFormat{".glb", true, mesh::writeGlb},
};

const WrittenFormat& writtenFormat(const fs::path& file) {
  const std::string extension = lowerExtension(file);
  for (const WrittenFormat& format : kWrittenFormats)
    if (format.extension == extension) return format;
  throw Error(ErrorKind::file, file.string(),
              "meshes are written as .obj, .ply, .stl or .glb; give a name that ends so");
}

/// Throws `Error` if two vertices have different positions, but the same in single precision.
void requireDifferentInSinglePrecision(const TriangleMesh& mesh, const fs::path& file) {
  using Position = std::array<float, 3>;
  std::vector<std::pair<Position, std::uint32_t>> sorted(mesh.vertices.size());
  for (std::uint32_t v = 0; v < sorted.size(); ++v) {
    const Vector3& x = mesh.vertices[v];
    if (!(x.cwiseAbs().maxCoeff() <= double(std::numeric_limits<float>::max())))
      throw Error(ErrorKind::file, file.string(),
                  "a coordinate is too large for the single-precision numbers of this format; write .ply or .obj");
    sorted[v] = {{static_cast<float>(x[0]), static_cast<float>(x[1]), static_cast<float>(x[2])}, v};
  }
  std::ranges::sort(sorted);
  for (std::size_t i = 1; i < sorted.size(); ++i)
    if (sorted[i - 1].first == sorted[i].first &&
        mesh.vertices[sorted[i - 1].second] != mesh.vertices[sorted[i].second])
      throw Error(ErrorKind::file, file.string(),
                  "vertices are so close to each other that the single-precision numbers of this format cannot tell "
                  "them apart; write .ply or .obj");
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

void checkMeshWritable(const fs::path& file) {
  writtenFormat(file);
  checkWritable(file);
}

bool isSinglePrecisionMesh(const fs::path& file) { return writtenFormat(file).isSingle; }

bool holdsVertexData(const fs::path& file) { return writtenFormat(file).extension != std::string_view(".stl"); }

void saveMesh(const TriangleMesh& mesh, const fs::path& file, const VertexData& data) {
  const WrittenFormat& format = writtenFormat(file);
  if (format.isSingle) requireDifferentInSinglePrecision(mesh, file);
  if (format.isSingle && mesh.triangles.empty())
    throw Error(ErrorKind::file, file.string(), "a mesh without triangles is written as .ply or .obj only");
  OutputFile out(file);
  format.write(mesh, data, [&](std::span<const std::byte> bytes) { out.write(bytes); });
  out.commit();
}

bool isReadByOthers(const fs::path& file) { return mesh::isReadByOthers(file); }

TriangleMesh readMesh(const fs::path& file, const Progress& progress) { return mesh::readMesh(file, progress); }

TriangleMesh readPly(std::string_view bytes, const std::string& name, const Progress& progress) {
  mesh::Input input(bytes, name, progress);
  return mesh::readPly(input);
}

void writePly(const TriangleMesh& mesh, const std::function<void(std::span<const std::byte>)>& write) {
  mesh::writePly(mesh, {}, write);
}

}  // namespace hpsdf
