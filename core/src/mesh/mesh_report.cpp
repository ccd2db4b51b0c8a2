#include "hpsdf/mesh_report.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/directed_edges.h"
#include "mesh/duplicates.h"
#include "mesh/face_sets.h"
#include "mesh/patches.h"

namespace hpsdf {
namespace {

std::size_t countUsedVertices(const TriangleMesh& mesh) {
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t v : triangle) used[v] = true;
  return static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
}

/// Which corner of a triangle a vertex is, numbered through all triangles.
std::uint32_t cornerOf(const TriangleMesh& mesh, std::uint32_t face, std::uint32_t vertex) {
  const auto& triangle = mesh.triangles[face];
  return 3 * face + static_cast<std::uint32_t>(std::ranges::find(triangle, vertex) - triangle.begin());
}

void addEdges(const TriangleMesh& mesh, std::span<const Side> sides, std::vector<Defect>& found) {
  forEachEdge(sides, [&](std::span<const Side> edge) {
    const auto add = [&](DefectKind kind) {
      found.push_back({kind,
                       {edge.front().face, edge.back().face},
                       {mesh.vertices[edge.front().low()], mesh.vertices[edge.front().high()]}});
    };
    if (edge.size() == 1)
      add(DefectKind::boundaryEdge);
    else if (edge.size() > 2)
      add(DefectKind::nonManifoldEdge);
    else if (edge[0].rising == edge[1].rising)
      add(DefectKind::inconsistentEdge);
  });
}

/// Corners of one vertex belong to one fan where their triangles share an edge there.
void addPinched(const TriangleMesh& mesh, std::span<const Side> sides, std::vector<Defect>& found) {
  FaceSets fans(3 * mesh.triangles.size());
  forEachEdge(sides, [&](std::span<const Side> edge) {
    for (const Side& side : edge.subspan(1))
      for (const std::uint32_t vertex : {edge.front().low(), edge.front().high()})
        fans.join(cornerOf(mesh, edge.front().face, vertex), cornerOf(mesh, side.face, vertex));
  });
  constexpr std::uint32_t kNone = 0xffffffff;
  struct Fans {
    std::uint32_t first = kNone, other = kNone;  // a corner of each
  };
  std::vector<Fans> at(mesh.vertices.size());
  for (std::uint32_t corner = 0; corner < 3 * mesh.triangles.size(); ++corner) {
    Fans& here = at[mesh.triangles[corner / 3][corner % 3]];
    if (here.first == kNone)
      here.first = corner;
    else if (here.other == kNone && fans.first(corner) != fans.first(here.first))
      here.other = corner;
  }
  for (std::size_t v = 0; v < at.size(); ++v)
    if (at[v].other != kNone)
      found.push_back(
          {DefectKind::pinchedVertex, {at[v].first / 3, at[v].other / 3}, {mesh.vertices[v], mesh.vertices[v]}});
}

/// How many are of triangles of one part, but for walls.
std::size_t foldsAmong(const TriangleMesh& mesh, std::span<const Side> sides, const Crossings& crossings) {
  if (crossings.found.empty()) return 0;
  FaceSets parts = partsOf(mesh.triangles.size(), sides);
  return static_cast<std::size_t>(std::ranges::count_if(crossings.found, [&](const Crossing& crossing) {
    const auto [one, other] = crossing.triangles;
    return parts.first(one) == parts.first(other) && !areTwins(mesh.triangles[one], mesh.triangles[other]);
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

  const std::vector<Side> sides = sidesByEdge(mesh.triangles);
  report.parts = partsOf(mesh.triangles.size(), sides).count();
  forEachEdge(sides, [&](std::span<const Side> edge) {
    if (2 * std::ranges::count(edge, true, &Side::rising) != std::ssize(edge)) ++report.unbalancedEdges;
    switch (edge.size()) {
      case 1:
        ++report.boundaryEdges;
        break;
      case 2:
        if (edge[0].rising == edge[1].rising) ++report.inconsistentEdges;
        break;
      default:
        ++report.nonManifoldEdges;
    }
  });
  return report;
}

std::span<const Defect> MeshDefects::of(DefectKind kind) const {
  const auto first = std::ranges::lower_bound(found, kind, {}, &Defect::kind);
  return {first, count(kind)};
}

MeshDefects findDefects(const TriangleMesh& mesh, const Crossings& crossings) {
  requireValidIndices(mesh);
  const std::vector<Side> sides = sidesByEdge(mesh.triangles);
  MeshDefects defects;
  defects.allCrossings = crossings.all;
  defects.orientable = std::ranges::count(patchesOf(mesh.triangles.size(), sides).oneSided, 1) == 0;
  addEdges(mesh, sides, defects.found);
  addPinched(mesh, sides, defects.found);

  defects.crossingsWithinParts = foldsAmong(mesh, sides, crossings);
  for (const Crossing& crossing : crossings.found)
    defects.found.push_back({DefectKind::crossing, crossing.triangles, {crossing.place, crossing.place}});
  std::ranges::stable_sort(defects.found, {}, &Defect::kind);
  for (const Defect& defect : defects.found) ++defects.counts[static_cast<std::size_t>(defect.kind)];
  return defects;
}

}  // namespace hpsdf
