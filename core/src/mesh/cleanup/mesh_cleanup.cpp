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
#include "mesh/message_prefix.h"
#include "mesh/orientation.h"

namespace hpsdf {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

template <typename T>
struct HashBytes {
  std::size_t operator()(const std::array<T, 3>& key) const { return XXH3_64bits(key.data(), sizeof key); }
};

void requireFinite(const TriangleMesh& mesh) {
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    if (!(mesh.vertices[i].cwiseAbs().array() <= kLargestCoordinate).all())
      throw Error(messagePrefix(mesh.name) + "vertex " + std::to_string(i + 1) +
                  " has a coordinate that is not a finite number (or beyond 1e100); repair or export the mesh again");
}

/// Gives vertices of equal position one index, that of the first; the others stay behind unused.
std::size_t weld(TriangleMesh& mesh) {
  std::unordered_map<std::array<std::uint64_t, 3>, std::uint32_t, HashBytes<std::uint64_t>> firstAt;
  firstAt.reserve(mesh.vertices.size());
  std::vector<std::uint32_t> representative(mesh.vertices.size());
  std::size_t welded = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    Vector3& v = mesh.vertices[i];
    v.array() += 0.0;  // -0.0 becomes 0.0, so that equal positions have equal bits
    const std::array<std::uint64_t, 3> key = {std::bit_cast<std::uint64_t>(v.x()), std::bit_cast<std::uint64_t>(v.y()),
                                              std::bit_cast<std::uint64_t>(v.z())};
    const auto [entry, isNew] = firstAt.try_emplace(key, static_cast<std::uint32_t>(i));
    representative[i] = entry->second;
    if (!isNew) ++welded;
  }
  for (Triangle& triangle : mesh.triangles)
    for (std::uint32_t& v : triangle) v = representative[v];
  return welded;
}

/// Faces that are left out, and the middle of the first.
struct Dropped {
  std::size_t faces = 0;
  Vector3 place = Vector3::Zero();
};

template <typename IsBad>
Dropped drop(TriangleMesh& mesh, const IsBad& isBad) {
  Dropped dropped;
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    if (!isBad(t)) return false;
    if (dropped.faces++ == 0) dropped.place = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3;
    return true;
  });
  return dropped;
}

Dropped dropCollapsed(TriangleMesh& mesh) {
  return drop(mesh, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
}

Dropped dropWithoutArea(TriangleMesh& mesh) {
  return drop(mesh, [&](const Triangle& t) { return hasNoArea(mesh, t); });
}

Dropped dropDuplicates(TriangleMesh& mesh) {
  const std::vector<char> superfluous = superfluousFaces(mesh.triangles);
  auto next = superfluous.begin();
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

}  // namespace

ImportedMesh cleanMesh(TriangleMesh mesh) {
  constexpr std::size_t kMost = std::numeric_limits<std::uint32_t>::max();
  if (mesh.vertices.size() >= kMost || mesh.triangles.size() >= kMost)
    throw Error(messagePrefix(mesh.name) + "more than 4294967294 vertices or faces; simplify the mesh first");
  requireValidIndices(mesh);
  requireFinite(mesh);

  const std::size_t given = mesh.triangles.size();
  const std::size_t welded = weld(mesh);
  const Dropped collapsed = dropCollapsed(mesh);
  const std::size_t flipped = flipCollinearFaces(mesh);
  const Dropped withoutArea = dropWithoutArea(mesh);
  const Dropped duplicates = dropDuplicates(mesh);
  if (mesh.triangles.empty())
    throw Error(messagePrefix(mesh.name) +
                (given == 0 ? "no faces"
                            : "no face with an area (" + std::to_string(given) +
                                  (given == 1 ? " face is" : " faces are") + " degenerate)") +
                "; a surface of triangles or polygons is needed");
  const std::size_t unreferenced = dropUnusedVertices(mesh) - welded;

  ImportedMesh result{std::move(mesh), {}};
  result.report = inspect(result.mesh);
  result.report.weldedVertices = welded;
  result.report.degenerateFaces = collapsed.faces + withoutArea.faces;
  result.report.degeneratePosition = (collapsed.faces > 0 ? collapsed : withoutArea).place;
  result.report.flippedFaces = flipped;
  result.report.duplicateFaces = duplicates.faces;
  result.report.duplicatePosition = duplicates.place;
  result.report.unreferencedVertices = unreferenced;
  if (looksInward(result.report.volume, result.report.area, result.report.box, result.report.unbalancedEdges == 0)) {
    for (Triangle& triangle : result.mesh.triangles) std::swap(triangle[1], triangle[2]);
    result.report.turned = true;
    result.report.volume = signedVolume(result.mesh);
  }
  return result;
}

}  // namespace hpsdf
