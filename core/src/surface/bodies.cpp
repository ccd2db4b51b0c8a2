#include "surface/bodies.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

namespace hpsdf {
namespace {

/// So far apart, in radians, faces lie in one plane but for rounding.
constexpr double kSameAngle = 1e-9;

/// Whether the edge is as most are: two faces of a patch take back each other's side.
bool isWithinPatch(const Patches& patches, std::span<const Side> edge) {
  return edge.size() == 2 && edge[0].rising != edge[1].rising && patches.of[edge[0].face] == patches.of[edge[1].face];
}

/// The sides at an edge without those that others of their patch take back. Of three of a patch the first or the last
/// is left: whichever, the patch is the same.
std::vector<Side> unbalanced(const Patches& patches, std::span<const Side> edge) {
  std::vector<Side> sides(edge.begin(), edge.end());
  std::ranges::stable_sort(sides, {}, [&](const Side& side) { return patches.of[side.face]; });
  std::vector<Side> left;
  for (const Side& side : sides) {
    const bool balances =
        !left.empty() && patches.of[left.back().face] == patches.of[side.face] && left.back().rising != side.rising;
    balances ? left.pop_back() : left.push_back(side);
  }
  return left;
}

/// A patch at an edge, around which there is a solid from where a face falls to where the next one rises.
struct Spoke {
  double angle;
  bool rising;
  std::uint32_t patch;
};

/// Counterclockwise as the edge comes towards the eye, from within rounding of 0. Those of faces in one plane get the
/// same angle, and what does not begin comes first; of these that look one way the solids before them are those of the
/// higher patches, at all their edges. `begins`: `Spoke::rising` of those that begin.
void sortAround(std::vector<Spoke>& spokes, bool begins) {
  std::ranges::sort(spokes, {}, &Spoke::angle);
  const auto before = [begins](const Spoke& a, const Spoke& b) {
    if (a.rising != b.rising) return b.rising == begins;
    return a.rising ? a.patch < b.patch : a.patch > b.patch;
  };
  for (auto first = spokes.begin(), next = first; first != spokes.end(); first = next) {
    while (++next != spokes.end() && next->angle - (next - 1)->angle < kSameAngle) {
    }
    for (auto same = first; same != next; ++same) same->angle = first->angle;
    std::sort(first, next, before);
  }
}

std::vector<Spoke> spokesOf(const TriangleMesh& mesh, const Patches& patches, std::span<const Side> sides) {
  const Vector3& low = mesh.vertices[sides.front().low()];
  const Vector3 along = (mesh.vertices[sides.front().high()] - low).stableNormalized();
  const auto away = [&](const Side& side) {
    const auto& [a, b, c] = mesh.triangles[side.face];
    const Vector3 arm = mesh.vertices[a ^ b ^ c ^ side.low() ^ side.high()] - low;
    return Vector3(arm - arm.dot(along) * along);
  };
  const Vector3 right = away(sides.front()).stableNormalized(), up = along.cross(right);
  std::vector<Spoke> spokes;
  for (const Side& side : sides) {
    const Vector3 arm = away(side);
    const double angle = std::atan2(arm.dot(up), arm.dot(right));
    spokes.push_back({angle < -kSameAngle ? angle + 2 * std::numbers::pi : angle, side.rising, patches.of[side.face]});
  }
  return spokes;
}

using Wedge = std::array<Spoke, 2>;

/// What lies between two faces at an edge, each from where one begins it to where the next that is left ends it; as
/// many begin as end one.
std::vector<Wedge> wedgesOf(std::vector<Spoke> spokes, bool begins) {
  sortAround(spokes, begins);
  std::vector<Wedge> wedges;
  std::vector<Spoke> begun;
  std::vector<char> ended(spokes.size(), 0);
  for (std::size_t i = 0; i < 2 * spokes.size(); ++i) {
    const std::size_t at = i % spokes.size();
    if (spokes[at].rising == begins) {
      if (i < spokes.size()) begun.push_back(spokes[at]);
    } else if (!begun.empty() && !std::exchange(ended[at], 1)) {
      wedges.push_back({begun.back(), spokes[at]});
      begun.pop_back();
    }
  }
  return wedges;
}

bool anyIsFlat(const std::vector<Wedge>& wedges) {
  return std::ranges::any_of(wedges, [](const Wedge& wedge) { return wedge[0].angle == wedge[1].angle; });
}

/// Joins patches that have a solid between them. Where that would make two faces in one plane a body, as where solids
/// that touch all look inwards, what is solid is read the other way; where that does, too, all are one.
void joinSolids(const std::vector<Spoke>& spokes, FaceSets& together) {
  std::vector<Wedge> wedges = wedgesOf(spokes, false);
  if (anyIsFlat(wedges)) wedges = wedgesOf(spokes, true);
  const bool unclear = anyIsFlat(wedges);
  for (const auto& [from, to] : wedges) {
    together.join(from.patch, to.patch);
    if (unclear) together.join(wedges.front()[0].patch, to.patch);
  }
}

}  // namespace

Bodies bodiesOf(const TriangleMesh& mesh, const Patches& patches, std::span<const Side> sides) {
  FaceSets together(patches.count);
  std::vector<char> open = patches.oneSided;
  forEachEdge(sides, [&](std::span<const Side> edge) {
    if (isWithinPatch(patches, edge)) return;
    const std::vector<Side> left = unbalanced(patches, edge);
    if (left.empty()) return;
    const auto rising = static_cast<std::size_t>(std::ranges::count_if(left, &Side::rising));
    if (2 * rising == left.size()) return joinSolids(spokesOf(mesh, patches, left), together);
    for (const Side& side : left) together.join(patches.of[left.front().face], patches.of[side.face]);
    open[patches.of[left.front().face]] = 1;
  });
  const auto count = static_cast<std::uint32_t>(patches.count);
  for (std::uint32_t patch = 0; patch < count; ++patch)
    if (open[patch]) open[together.first(patch)] = 1;
  Bodies bodies;
  for (std::uint32_t patch = 0; patch < count; ++patch) {
    const std::uint32_t body = together.first(patch);
    bodies.closed.push_back(!open[body]);
    bodies.of.push_back(open[body] ? patch : body);
  }
  return bodies;
}

}  // namespace hpsdf
