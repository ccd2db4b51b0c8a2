#include "hpsdf/mesh_report.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace hpsdf {
namespace {

/// One triangle's side, filed under its undirected edge.
struct Side {
  std::uint64_t edge;  ///< lower vertex in the high half, higher vertex in the low half
  std::uint32_t face;
  bool rising;  ///< runs from the lower to the higher vertex
};

std::vector<Side> sidesByEdge(const TriangleMesh& mesh) {
  std::vector<Side> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t from = mesh.triangles[f][i];
      const std::uint32_t to = mesh.triangles[f][(i + 1) % 3];
      if (from == to) continue;  // of a degenerate face: no edge
      const auto [low, high] = std::minmax(from, to);
      sides.push_back({std::uint64_t{low} << 32 | high, static_cast<std::uint32_t>(f), from < to});
    }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.edge < b.edge; });
  return sides;
}

/// Disjoint sets of faces (union-find with path halving).
class FaceSets {
 public:
  explicit FaceSets(std::size_t faces) : parent_(faces), sets_(faces) {
    std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
  }

  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    if (a == b) return;
    parent_[std::max(a, b)] = std::min(a, b);
    --sets_;
  }

  std::size_t count() const { return sets_; }

 private:
  std::uint32_t root(std::uint32_t face) {
    while (parent_[face] != face) face = parent_[face] = parent_[parent_[face]];
    return face;
  }

  std::vector<std::uint32_t> parent_;
  std::size_t sets_;
};

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

  const std::vector<Side> sides = sidesByEdge(mesh);
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
