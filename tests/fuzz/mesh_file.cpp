// Fuzz target: a mesh file of the format HPSDF_MESH_FORMAT is refused, or gives a mesh that can be cleaned, and that is
// the same again after it was written as PLY.
#include "hpsdf/mesh_file.h"

#include <algorithm>
#include <string>

#include "target.h"

namespace {

using namespace hpsdf;

bool isValid(const TriangleMesh& mesh) {
  const auto isInRange = [&](const Triangle& triangle) { return std::ranges::max(triangle) < mesh.vertices.size(); };
  return std::ranges::all_of(mesh.vertices, [](const Vector3& v) { return v.allFinite(); }) &&
         std::ranges::all_of(mesh.triangles, isInRange);
}

std::string plyOf(const TriangleMesh& mesh) {
  std::string bytes;
  writePly(mesh, [&](std::span<const std::byte> piece) {
    bytes.append(reinterpret_cast<const char*>(piece.data()), piece.size());
  });
  return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::reads([&] {
    const TriangleMesh mesh = readMesh(fuzz::fileOf("mesh" HPSDF_MESH_FORMAT, fuzz::textOf(data, size)));
    fuzz::require(isValid(mesh), "coordinates are finite and indices in range");
    const TriangleMesh again = readPly(plyOf(mesh), "again.ply");
    fuzz::require(again.vertices == mesh.vertices && again.triangles == mesh.triangles, "PLY keeps every bit");
    fuzz::reads([&] { cleaned(mesh); });
  });
  return 0;
}
