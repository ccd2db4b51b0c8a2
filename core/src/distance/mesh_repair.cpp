#include "hpsdf/mesh_repair.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "distance/hierarchy.h"
#include "distance/inside.h"
#include "distance/winding.h"
#include "mesh/looks_inward.h"
#include "mesh/patches.h"
#include "mesh/sides.h"

namespace hpsdf {
namespace {

/// What is known of a patch.
struct Patch {
  double area = 0, areaAgainst = 0;  ///< of all its triangles; of those that look the other way
  Box box;
  double volume = 0;
  std::uint32_t greatest = 0;  ///< of its triangles
  bool closed = true;
  bool turned = false;
};

Vector3 areaVector(const TriangleMesh& mesh, std::uint32_t face) {
  const auto& [a, b, c] = mesh.triangles[face];
  return (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]) / 2;
}

void turn(TriangleMesh& mesh, std::uint32_t face) { std::swap(mesh.triangles[face][1], mesh.triangles[face][2]); }

std::vector<Patch> measured(const TriangleMesh& mesh, const Patches& patches, std::span<const Side> sides) {
  std::vector<Patch> found(patches.count);
  std::vector<double> greatest(patches.count, -1);
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    Patch& patch = found[patches.of[f]];
    const double area = areaVector(mesh, f).norm();
    patch.area += area;
    if (patches.against[f]) patch.areaAgainst += area;
    for (const std::uint32_t v : mesh.triangles[f]) patch.box.extend(mesh.vertices[v]);
    if (area > greatest[patches.of[f]]) {
      greatest[patches.of[f]] = area;
      patch.greatest = f;
    }
  }
  forEachEdge(sides, [&](std::span<const Side> edge) {
    if (edge.size() == 2) return;
    for (const Side& side : edge) found[patches.of[side.face]].closed = false;
  });
  return found;
}

/// Makes the triangles of each patch look one way, but for those that cannot; how many were turned.
std::size_t agree(TriangleMesh& mesh, const Patches& patches, const std::vector<Patch>& found) {
  std::size_t turned = 0;
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    const Patch& patch = found[patches.of[f]];
    const char minority = patch.areaAgainst <= patch.area / 2 ? 1 : 0;
    if (patches.oneSided[patches.of[f]] || patches.against[f] != minority) continue;
    turn(mesh, f);
    ++turned;
  }
  return turned;
}

/// As of tetrahedra between the triangles and the middle of the patch's box.
void addVolumes(const TriangleMesh& mesh, const Patches& patches, std::vector<Patch>& found) {
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    Patch& patch = found[patches.of[f]];
    patch.volume += areaVector(mesh, f).dot(mesh.vertices[mesh.triangles[f][0]] - patch.box.center()) / 3;
  }
}

void turnPatches(TriangleMesh& mesh, const Patches& patches, const std::vector<Patch>& found) {
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f)
    if (found[patches.of[f]].turned) turn(mesh, f);
}

/// Puts back what is a cavity, of closed patches that were turned: what is within an odd number of others. `mesh`: as
/// it is with all closed patches looking outwards.
void spareCavities(const TriangleMesh& mesh, const Patches& patches, std::vector<Patch>& found) {
  TriangleMesh closed{.vertices = mesh.vertices, .triangles = {}, .name = mesh.name};
  std::size_t others = 0;
  for (const Patch& patch : found) others += patch.closed;
  if (others < 2 || std::ranges::none_of(found, [](const Patch& p) { return p.closed && p.turned; })) return;
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f)
    if (found[patches.of[f]].closed) closed.triangles.push_back(mesh.triangles[f]);
  const distance::Hierarchy hierarchy(closed, boundingBox(closed));
  const distance::Winding winding(hierarchy);
  const double aside = distance::besideSurface(boundingBox(closed));
  for (Patch& patch : found) {
    if (!patch.closed || !patch.turned) continue;
    const auto& [a, b, c] = mesh.triangles[patch.greatest];
    const Vector3 before = (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3 +
                           aside * areaVector(mesh, patch.greatest).stableNormalized();
    const auto within = winding.within(before, 0.25, [](const auto&) { return false; });
    patch.turned = std::lround(within.value) % 2 == 0;
  }
}

}  // namespace

RepairedMesh repaired(ImportedMesh imported) {
  TriangleMesh& mesh = imported.mesh;
  distance::requireSurface(mesh);
  const std::vector<Side> sides = sidesByEdge(mesh.triangles);
  const Patches patches = patchesOf(mesh.triangles.size(), sides);
  std::vector<Patch> found = measured(mesh, patches, sides);
  RepairedMesh result;
  result.turnedFaces = agree(mesh, patches, found);
  addVolumes(mesh, patches, found);
  for (Patch& patch : found) patch.turned = looksInward(patch.volume, patch.area, patch.box, patch.closed);
  TriangleMesh outward = mesh;
  turnPatches(outward, patches, found);
  spareCavities(outward, patches, found);
  turnPatches(mesh, patches, found);
  result.turnedPatches = static_cast<std::size_t>(std::ranges::count_if(found, &Patch::turned));

  const MeshReport now = inspect(mesh);
  imported.report.inconsistentEdges = now.inconsistentEdges;  // nothing else depends on which way faces look
  imported.report.unbalancedEdges = now.unbalancedEdges;
  imported.report.volume = now.volume;
  result.leftEdges = now.inconsistentEdges;
  result.imported = std::move(imported);
  return result;
}

}  // namespace hpsdf
