#include "hpsdf/mesh_file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "hpsdf/detail/text.h"
#include "hpsdf/error.h"
#include "hpsdf/shapes.h"
#include "mesh/cleanup/mesh_cleanup.h"
#include "mesh/file/assimp_import.h"
#include "mesh/file/mesh_export.h"

namespace hpsdf {
namespace {

namespace fs = std::filesystem;

double largestCoordinate(const Box& box) { return box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff(); }

/// The distance between adjacent floats near a coordinate.
double floatSpacing(double coordinate) {
  constexpr int kBits = std::numeric_limits<float>::digits, kSmallest = std::numeric_limits<float>::min_exponent;
  const int exponent = coordinate > 0 ? std::ilogb(coordinate) + 1 : kSmallest;
  return std::ldexp(1.0, std::max(exponent, kSmallest) - kBits);
}

/// The end of a message about a mesh without area, where the rounding to float is the probable cause; else empty.
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

/// Returns true if any face has three different vertices. Only such a face can have lost its area by rounding.
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

}  // namespace

ImportedMesh cleaned(TriangleMesh mesh) { return mesh::cleanMesh(std::move(mesh)); }

double coordinateSpacing(const fs::path& file, const TriangleMesh& mesh) {
  const Box box = boundingBox(mesh);
  return box.isEmpty() || !mesh::mayExceedFloat(file) ? 0 : floatSpacing(largestCoordinate(box));
}

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
  ply ? mesh::writePly(mesh, out) : mesh::writeObj(mesh, out);
  out.commit();
}

}  // namespace hpsdf
