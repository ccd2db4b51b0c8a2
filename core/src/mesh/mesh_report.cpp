#include "hpsdf/mesh_report.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/patches.h"
#include "mesh/sides.h"

namespace hpsdf {
namespace {

std::size_t countUsedVertices(const TriangleMesh& mesh) {
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t v : triangle) used[v] = true;
  return static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
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

}  // namespace hpsdf
