#include "contour/edits/edge_collapse.h"

#include <algorithm>
#include <iterator>
#include <span>

#include "contour/cells/projection.h"
#include "util/single_precision.h"

namespace hpsdf::contouring {
namespace {

/// Returns the triangles at one vertex or the other.
std::vector<std::uint32_t> trianglesAtEither(const EditedMesh& mesh, std::uint32_t a, std::uint32_t b) {
  std::vector<std::uint32_t> all;
  std::ranges::set_union(mesh.trianglesAt(a), mesh.trianglesAt(b), std::back_inserter(all));
  return all;
}

/// Returns the vertices that have an edge in common with a vertex, in ascending order.
std::vector<std::uint32_t> neighborsOf(const EditedMesh& mesh, std::uint32_t vertex) {
  std::vector<std::uint32_t> neighbors;
  for (const std::uint32_t n : mesh.trianglesAt(vertex))
    for (const std::uint32_t other : mesh.triangles()[n])
      if (other != vertex) neighbors.push_back(other);
  std::ranges::sort(neighbors);
  neighbors.erase(std::unique(neighbors.begin(), neighbors.end()), neighbors.end());
  return neighbors;
}

/// Returns true if the mesh stays a manifold when the ends of an edge are merged: the ends have two neighbours in
/// common, and the solid is more than a tetrahedron there.
bool staysManifold(const EditedMesh& mesh, std::uint32_t a, std::uint32_t b) {
  if (mesh.isAtBoundary(a) || mesh.isAtBoundary(b)) return false;
  std::vector<std::uint32_t> common;
  std::ranges::set_intersection(neighborsOf(mesh, a), neighborsOf(mesh, b), std::back_inserter(common));
  return common.size() == 2 && std::ranges::all_of(common, [&](std::uint32_t vertex) {
           return mesh.isAtBoundary(vertex) || mesh.trianglesAt(vertex).size() > 3;
         });
}

}  // namespace

MergedVertex mergedVertex(const EditedMesh& mesh, std::uint32_t a, std::uint32_t b) {
  std::vector<TangentPlane> planes;
  for (const std::uint32_t n : trianglesAtEither(mesh, a, b)) {
    const auto [p, q, r] = mesh.corners(n);
    const Vector3 normal = (q - p).cross(r - p);
    if (const double length = normal.norm(); length > 0) planes.push_back({(p + q + r) / 3, normal / length});
  }
  const Vector3 middle = (mesh.vertices()[a] + mesh.vertices()[b]) / 2;
  if (planes.empty()) return {middle, 0};
  const Vector3 meeting = meetingPointOf(planes, middle);
  const double reach = (mesh.vertices()[a] - mesh.vertices()[b]).norm();
  const Vector3 position = (meeting - middle).norm() <= reach ? meeting : middle;
  return {position, greatestDistance(position, planes)};
}

std::optional<Edit> collapseOf(const EditedMesh& mesh, std::uint32_t a, std::uint32_t b) {
  if (!staysManifold(mesh, a, b)) return std::nullopt;
  Edit edit{.removed = trianglesAtEither(mesh, a, b),
            .added = {},
            .vertex = a,
            .position = mergedVertex(mesh, a, b).position};
  for (const std::uint32_t n : edit.removed) {
    Triangle triangle = mesh.triangles()[n];
    std::ranges::replace(triangle, b, a);
    if (std::ranges::count(triangle, a) == 1) edit.added.push_back(triangle);
  }
  return edit;
}

void placeVertex(const ImplicitSurface& surface, const EditLimits& limits, Edit& edit) {
  constexpr double kBeforeRounding = 0.25;
  double magnitude = 0;
  projectOntoSurface(surface, limits.accuracy * (limits.isSinglePrecision ? kBeforeRounding : 1), {&edit.position, 1},
                     {&magnitude, 1});
  if (limits.isSinglePrecision) edit.position = detail::inSinglePrecision(edit.position);
}

}  // namespace hpsdf::contouring
