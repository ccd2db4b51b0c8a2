#include "mesh/cleanup/mesh_cleanup.h"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "hpsdf/error.h"
#include "mesh/cleanup/collinear_faces.h"
#include "mesh/duplicates.h"
#include "mesh/mesh_error.h"
#include "mesh/orientation.h"

namespace hpsdf::mesh {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using PositionBits = std::array<std::uint64_t, 3>;

struct HashBits {
  std::size_t operator()(const PositionBits& key) const { return XXH3_64bits(key.data(), sizeof key); }
};

void requireUsable(const TriangleMesh& mesh) {
  constexpr std::size_t kMost = std::numeric_limits<std::uint32_t>::max();
  if (mesh.vertices.size() >= kMost || mesh.triangles.size() >= kMost)
    throw meshError(mesh.name, "more than 4294967294 vertices or faces; simplify the mesh first");
  requireValidIndices(mesh);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    if (!(mesh.vertices[i].cwiseAbs().array() <= kLargestCoordinate).all())
      throw meshError(
          mesh.name,
          "vertex " + std::to_string(i + 1) +
              " has a coordinate that is not a finite number (or beyond 1e100); repair or export the mesh again");
}

/// Replaces vertices of equal position by the first of them in all triangles, and returns the number of vertices that
/// this leaves unused.
std::size_t weld(TriangleMesh& mesh) {
  std::unordered_map<PositionBits, std::uint32_t, HashBits> firstAt;
  firstAt.reserve(mesh.vertices.size());
  std::vector<std::uint32_t> representative(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    Vector3& v = mesh.vertices[i];
    v.array() += 0.0;  // Adding 0 turns -0 into 0, so that equal positions have equal bits.
    const PositionBits key = {std::bit_cast<std::uint64_t>(v.x()), std::bit_cast<std::uint64_t>(v.y()),
                              std::bit_cast<std::uint64_t>(v.z())};
    representative[i] = firstAt.try_emplace(key, static_cast<std::uint32_t>(i)).first->second;
  }
  for (Triangle& triangle : mesh.triangles)
    for (std::uint32_t& v : triangle) v = representative[v];
  return mesh.vertices.size() - firstAt.size();
}

/// The number of triangles dropped for one reason, and the centroid of the first.
struct Dropped {
  std::size_t faces = 0;
  Vector3 position = Vector3::Zero();
};

template <typename IsBad>
Dropped drop(TriangleMesh& mesh, const IsBad& isBad) {
  Dropped dropped;
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    if (!isBad(t)) return false;
    if (dropped.faces++ == 0) dropped.position = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3;
    return true;
  });
  return dropped;
}

Dropped dropDuplicates(TriangleMesh& mesh) {
  const std::vector<char> redundant = redundantFaces(mesh.triangles);
  auto next = redundant.begin();
  return drop(mesh, [&](const Triangle&) { return *next++ != 0; });
}

std::size_t dropUnusedVertices(TriangleMesh& mesh) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> newIndex(mesh.vertices.size(), kUnused);
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t v : triangle) newIndex[v] = 0;
  std::uint32_t kept = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (newIndex[i] == kUnused) continue;
    mesh.vertices[kept] = mesh.vertices[i];
    newIndex[i] = kept++;
  }
  for (Triangle& triangle : mesh.triangles)
    for (std::uint32_t& v : triangle) v = newIndex[v];
  const std::size_t dropped = mesh.vertices.size() - kept;
  mesh.vertices.resize(kept);
  return dropped;
}

void requireFaces(const TriangleMesh& mesh, std::size_t facesBefore) {
  if (!mesh.triangles.empty()) return;
  const std::string problem = facesBefore == 0 ? "no faces"
                                               : "no face with an area (" + std::to_string(facesBefore) +
                                                     (facesBefore == 1 ? " face is" : " faces are") + " degenerate)";
  throw meshError(mesh.name, problem + "; a surface of triangles or polygons is needed");
}

}  // namespace

ImportedMesh cleanMesh(TriangleMesh mesh) {
  requireUsable(mesh);
  const std::size_t facesBefore = mesh.triangles.size();
  const std::size_t welded = weld(mesh);
  const Dropped collapsed = drop(mesh, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  const std::size_t flipped = flipCollinearFaces(mesh);
  const Dropped withoutArea = drop(mesh, [&](const Triangle& t) { return hasNoArea(mesh, t); });
  const Dropped duplicates = dropDuplicates(mesh);
  requireFaces(mesh, facesBefore);
  const std::size_t unreferenced = dropUnusedVertices(mesh) - welded;

  ImportedMesh result{std::move(mesh), {}};
  MeshReport& report = result.report = inspect(result.mesh);
  report.weldedVertices = welded;
  report.degenerateFaces = collapsed.faces + withoutArea.faces;
  report.degeneratePosition = (collapsed.faces > 0 ? collapsed : withoutArea).position;
  report.flippedFaces = flipped;
  report.duplicateFaces = duplicates.faces;
  report.duplicatePosition = duplicates.position;
  report.unreferencedVertices = unreferenced;
  if (facesInward(report.volume, report.area, report.box, report.unbalancedEdges == 0)) {
    for (Triangle& triangle : result.mesh.triangles) std::swap(triangle[1], triangle[2]);
    report.reversed = true;
    report.volume = signedVolume(result.mesh);
  }
  return result;
}

}  // namespace hpsdf::mesh
