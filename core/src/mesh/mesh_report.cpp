#include "hpsdf/mesh_report.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "mesh/face_sets.h"
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
  FaceSets parts(mesh.triangles.size());
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    while (end < sides.size() && sides[end].edge == sides[begin].edge) {
      parts.join(sides[begin].face, sides[end].face);
      ++end;
    }
    switch (end - begin) {
      case 1:
        ++report.boundaryEdges;
        break;
      case 2:
        if (sides[begin].rising == sides[begin + 1].rising) ++report.inconsistentEdges;
        break;
      default:
        ++report.nonManifoldEdges;
    }
  }
  report.parts = parts.count();
  return report;
}

}  // namespace hpsdf
