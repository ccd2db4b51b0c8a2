#include "hpsdf/mesh_report.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "mesh/connectivity.h"
#include "mesh/duplicates.h"

namespace hpsdf {
namespace {

using mesh::DirectedEdge;

std::size_t countUsedVertices(const TriangleMesh& mesh) {
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t v : triangle) used[v] = true;
  return static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
}

/// Returns the defect of an undirected edge, or std::nullopt if it has none. `edge` holds the directed edges along it.
std::optional<DefectKind> defectOf(std::span<const DirectedEdge> edge) {
  if (edge.size() == 1) return DefectKind::boundaryEdge;
  if (edge.size() > 2) return DefectKind::nonManifoldEdge;
  if (edge[0].rising == edge[1].rising) return DefectKind::inconsistentEdge;
  return std::nullopt;
}

void addEdges(const TriangleMesh& mesh, std::span<const DirectedEdge> edges, std::vector<Defect>& found) {
  mesh::forEachEdge(edges, [&](std::span<const DirectedEdge> edge) {
    if (const auto kind = defectOf(edge))
      found.push_back({*kind,
                       {edge.front().face, edge.back().face},
                       {mesh.vertices[edge.front().low()], mesh.vertices[edge.front().high()]}});
  });
}

/// Returns the index of the corner of triangle `face` at the vertex `vertex`. The corners of triangle n have the
/// indices 3n to 3n + 2.
std::uint32_t cornerOf(const TriangleMesh& mesh, std::uint32_t face, std::uint32_t vertex) {
  const auto& triangle = mesh.triangles[face];
  return 3 * face + static_cast<std::uint32_t>(std::ranges::find(triangle, vertex) - triangle.begin());
}

/// Appends a defect to `found` for each vertex at which more than one fan of triangles meets. Triangles belong to
/// the same fan if they are connected by edges at the vertex.
void addPinchedVertices(const TriangleMesh& mesh, std::span<const DirectedEdge> edges, std::vector<Defect>& found) {
  // Unite corners at the same vertex if their triangles share an edge there. The resulting sets are the fans.
  mesh::DisjointSets fans(3 * mesh.triangles.size());
  mesh::forEachEdge(edges, [&](std::span<const DirectedEdge> edge) {
    for (const DirectedEdge& other : edge.subspan(1))
      for (const std::uint32_t vertex : {edge.front().low(), edge.front().high()})
        fans.join(cornerOf(mesh, edge.front().face, vertex), cornerOf(mesh, other.face, vertex));
  });

  // Find, for each vertex, its first corner and a corner that belongs to a different fan than the first one.
  constexpr std::uint32_t kNone = 0xffffffff;
  struct Corners {
    std::uint32_t first = kNone, ofOtherFan = kNone;
  };
  std::vector<Corners> cornersAt(mesh.vertices.size());
  for (std::uint32_t corner = 0; corner < 3 * mesh.triangles.size(); ++corner) {
    Corners& here = cornersAt[mesh.triangles[corner / 3][corner % 3]];
    if (here.first == kNone)
      here.first = corner;
    else if (here.ofOtherFan == kNone && fans.first(corner) != fans.first(here.first))
      here.ofOtherFan = corner;
  }
  for (std::size_t v = 0; v < cornersAt.size(); ++v)
    if (const auto [first, other] = cornersAt[v]; other != kNone)
      found.push_back({DefectKind::pinchedVertex, {first / 3, other / 3}, {mesh.vertices[v], mesh.vertices[v]}});
}

/// Returns the number of pairs of triangles in the same connected component that intersect each other. Pairs of
/// triangles with the same three corners do not count.
std::size_t countFolds(const TriangleMesh& mesh, std::span<const DirectedEdge> edges, const Crossings& crossings) {
  if (crossings.found.empty()) return 0;
  mesh::DisjointSets components = mesh::componentsOf(mesh.triangles.size(), edges);
  return static_cast<std::size_t>(std::ranges::count_if(crossings.found, [&](const Crossing& crossing) {
    const auto [one, other] = crossing.triangles;
    return components.first(one) == components.first(other) &&
           !mesh::haveSameCorners(mesh.triangles[one], mesh.triangles[other]);
  }));
}

}  // namespace

MeshReport inspect(const TriangleMesh& mesh) {
  requireValidIndices(mesh);
  MeshReport report;
  report.vertices = countUsedVertices(mesh);
  report.faces = mesh.triangles.size();
  report.volume = signedVolume(mesh);
  report.area = surfaceArea(mesh);
  report.box = boundingBox(mesh);

  const std::vector<DirectedEdge> edges = mesh::directedEdgesOf(mesh.triangles);
  report.components = mesh::componentsOf(mesh.triangles.size(), edges).count();
  mesh::forEachEdge(edges, [&](std::span<const DirectedEdge> edge) {
    if (2 * std::ranges::count(edge, true, &DirectedEdge::rising) != std::ssize(edge)) ++report.unbalancedEdges;
    const std::optional<DefectKind> defect = defectOf(edge);
    report.boundaryEdges += defect == DefectKind::boundaryEdge;
    report.nonManifoldEdges += defect == DefectKind::nonManifoldEdge;
    report.inconsistentEdges += defect == DefectKind::inconsistentEdge;
  });
  return report;
}

std::span<const Defect> MeshDefects::ofKind(DefectKind kind) const {
  const auto first = std::ranges::lower_bound(found, kind, {}, &Defect::kind);
  return {first, count(kind)};
}

MeshDefects findDefects(const TriangleMesh& mesh, const Crossings& crossings) {
  requireValidIndices(mesh);
  const std::vector<DirectedEdge> edges = mesh::directedEdgesOf(mesh.triangles);
  MeshDefects defects;
  defects.allCrossings = crossings.complete;
  defects.orientable = std::ranges::count(mesh::patchesOf(mesh.triangles.size(), edges).oneSided, 1) == 0;
  defects.crossingsWithinComponents = countFolds(mesh, edges, crossings);
  addEdges(mesh, edges, defects.found);
  addPinchedVertices(mesh, edges, defects.found);
  for (const Crossing& crossing : crossings.found)
    defects.found.push_back({DefectKind::crossing, crossing.triangles, {crossing.position, crossing.position}});
  std::ranges::stable_sort(defects.found, {}, &Defect::kind);
  for (const Defect& defect : defects.found) ++defects.counts[static_cast<std::size_t>(defect.kind)];
  return defects;
}

}  // namespace hpsdf
