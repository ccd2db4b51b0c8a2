#include "surface/bodies.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

namespace hpsdf::surface {
namespace {

/// Angle in radians below which two faces count as coplanar.
constexpr double kSameAngle = 1e-9;

/// Returns true if the edge lies within one patch, as most do, between two faces that run along it in opposite
/// directions.
bool isWithinPatch(const mesh::Patches& patches, std::span<const mesh::DirectedEdge> edge) {
  return edge.size() == 2 && edge[0].rising != edge[1].rising &&
         patches.patchOf[edge[0].face] == patches.patchOf[edge[1].face];
}

/// Returns the directed edges at an edge that remain after pairs of one patch with opposite directions have cancelled.
/// The order of cancellation does not matter, because only the patch of a remaining one is used.
std::vector<mesh::DirectedEdge> unbalanced(const mesh::Patches& patches, std::span<const mesh::DirectedEdge> edge) {
  std::vector<mesh::DirectedEdge> sides(edge.begin(), edge.end());
  std::ranges::stable_sort(sides, {}, [&](const mesh::DirectedEdge& side) { return patches.patchOf[side.face]; });
  std::vector<mesh::DirectedEdge> remaining;
  for (const mesh::DirectedEdge& side : sides) {
    const bool cancels = !remaining.empty() && patches.patchOf[remaining.back().face] == patches.patchOf[side.face] &&
                         remaining.back().rising != side.rising;
    cancels ? remaining.pop_back() : remaining.push_back(side);
  }
  return remaining;
}

/// A face at an edge in the radial order around it. In a correctly oriented mesh, solid material lies between a falling
/// face and the next rising one, counterclockwise.
struct RadialFace {
  double angle;  ///< in radians, around the edge
  bool rising;
  std::uint32_t patch;
};

/// Sorts faces counterclockwise, as seen with the edge pointing to the viewer. Coplanar faces get the same angle; those
/// that end a solid precede those that begin one. Coincident faces of one orientation are sorted by patch, so that
/// solids are matched with the same patches at all edges of a shared wall. `begins` is `rising` of the faces that begin
/// a solid.
void sortAround(std::vector<RadialFace>& faces, bool begins) {
  std::ranges::sort(faces, {}, &RadialFace::angle);
  const auto before = [begins](const RadialFace& a, const RadialFace& b) {
    if (a.rising != b.rising) return b.rising == begins;
    return a.rising ? a.patch < b.patch : a.patch > b.patch;
  };
  for (auto first = faces.begin(), next = first; first != faces.end(); first = next) {
    while (++next != faces.end() && next->angle - (next - 1)->angle < kSameAngle) {
    }
    for (auto same = first; same != next; ++same) same->angle = first->angle;
    std::sort(first, next, before);
  }
}

/// Returns the faces at an edge with their angles, measured from the first of them.
std::vector<RadialFace> radialFaces(const TriangleMesh& mesh, const mesh::Patches& patches,
                                    std::span<const mesh::DirectedEdge> sides) {
  const Vector3& low = mesh.vertices[sides.front().low()];
  const Vector3 along = (mesh.vertices[sides.front().high()] - low).stableNormalized();
  const auto fromEdge = [&](const mesh::DirectedEdge& side) {
    const auto& [a, b, c] = mesh.triangles[side.face];
    const std::uint32_t apex = a ^ b ^ c ^ side.low() ^ side.high();
    const Vector3 arm = mesh.vertices[apex] - low;
    return Vector3(arm - arm.dot(along) * along);
  };
  const Vector3 right = fromEdge(sides.front()).stableNormalized(), up = along.cross(right);
  std::vector<RadialFace> faces;
  for (const mesh::DirectedEdge& side : sides) {
    const Vector3 arm = fromEdge(side);
    const double angle = std::atan2(arm.dot(up), arm.dot(right));
    faces.push_back(
        {angle < -kSameAngle ? angle + 2 * std::numbers::pi : angle, side.rising, patches.patchOf[side.face]});
  }
  return faces;
}

/// Two faces at an edge with solid material between them.
using Wedge = std::array<RadialFace, 2>;

/// Matches each face that begins a solid with the face that ends it, as parentheses are matched, in two passes around
/// the edge. There are as many of either.
std::vector<Wedge> wedgesOf(std::vector<RadialFace> faces, bool begins) {
  sortAround(faces, begins);
  std::vector<Wedge> wedges;
  std::vector<RadialFace> begun;
  std::vector<char> ended(faces.size(), 0);
  for (std::size_t i = 0; i < 2 * faces.size(); ++i) {
    const std::size_t at = i % faces.size();
    if (faces[at].rising == begins) {
      if (i < faces.size()) begun.push_back(faces[at]);
    } else if (!begun.empty() && !std::exchange(ended[at], 1)) {
      wedges.push_back({begun.back(), faces[at]});
      begun.pop_back();
    }
  }
  return wedges;
}

bool anyIsFlat(const std::vector<Wedge>& wedges) {
  return std::ranges::any_of(wedges, [](const Wedge& wedge) { return wedge[0].angle == wedge[1].angle; });
}

/// Joins patches that have solid material between them at an edge. Coplanar faces would make a flat body where touching
/// solids are all oriented inward: then solid and empty are exchanged. If that leads to a flat body too, all patches at
/// the edge are joined.
void joinSolids(const std::vector<RadialFace>& faces, mesh::DisjointSets& bodies) {
  std::vector<Wedge> wedges = wedgesOf(faces, false);
  if (anyIsFlat(wedges)) wedges = wedgesOf(faces, true);
  const bool unclear = anyIsFlat(wedges);
  for (const auto& [from, to] : wedges) {
    bodies.join(from.patch, to.patch);
    if (unclear) bodies.join(wedges.front()[0].patch, to.patch);
  }
}

}  // namespace

Bodies findBodies(const TriangleMesh& mesh, const mesh::Patches& patches, std::span<const mesh::DirectedEdge> sides) {
  mesh::DisjointSets joined(patches.count);
  std::vector<char> open = patches.oneSided;
  mesh::forEachEdge(sides, [&](std::span<const mesh::DirectedEdge> edge) {
    if (isWithinPatch(patches, edge)) return;
    const std::vector<mesh::DirectedEdge> remaining = unbalanced(patches, edge);
    if (remaining.empty()) return;
    const auto rising = static_cast<std::size_t>(std::ranges::count_if(remaining, &mesh::DirectedEdge::rising));
    if (2 * rising == remaining.size()) return joinSolids(radialFaces(mesh, patches, remaining), joined);
    const std::uint32_t first = patches.patchOf[remaining.front().face];
    for (const mesh::DirectedEdge& side : remaining) joined.join(first, patches.patchOf[side.face]);
    open[first] = 1;
  });
  const auto count = static_cast<std::uint32_t>(patches.count);
  for (std::uint32_t patch = 0; patch < count; ++patch)
    if (open[patch]) open[joined.first(patch)] = 1;
  // The patches of an open body become bodies of their own.
  Bodies bodies;
  for (std::uint32_t patch = 0; patch < count; ++patch) {
    const std::uint32_t body = joined.first(patch);
    bodies.closed.push_back(!open[body]);
    bodies.ofPatch.push_back(open[body] ? patch : body);
  }
  return bodies;
}

}  // namespace hpsdf::surface
