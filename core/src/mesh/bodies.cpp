#include "mesh/bodies.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numbers>
#include <utility>

namespace hpsdf {
namespace {

/// So far apart, in radians, faces lie in one plane but for rounding.
constexpr double kSameAngle = 1e-9;

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

/// Counterclockwise as the edge comes towards the eye, from within rounding of 0. Those of faces in one plane have the
/// same angle; of these that look one way the solids before them are those of the higher patches, at all their edges.
void sortAround(std::vector<Spoke>& spokes) {
  std::ranges::sort(spokes, {}, &Spoke::angle);
  const auto before = [](const Spoke& a, const Spoke& b) { return a.rising ? a.patch < b.patch : a.patch > b.patch; };
  for (auto first = spokes.begin(), next = first; first != spokes.end(); first = next) {
    while (++next != spokes.end() && next->angle - (next - 1)->angle < kSameAngle) {
    }
    for (auto same = first; same != next; ++same) same->angle = first->angle;
    const auto falling = std::partition(first, next, [](const Spoke& spoke) { return spoke.rising; });
    std::sort(first, falling, before);
    std::sort(falling, next, before);
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
  sortAround(spokes);
  return spokes;
}

using Wedge = std::array<Spoke, 2>;

/// What lies between two faces at an edge, each from where one begins it to where the next that is left ends it; as
/// many begin as end one. `begins`: `Spoke::rising` of those that begin. What ends in a plane does so before what
/// begins.
std::vector<Wedge> wedgesOf(const std::vector<Spoke>& spokes, bool begins) {
  std::vector<Spoke> around;
  for (auto first = spokes.begin(); first != spokes.end();) {
    const auto next = std::find_if(first, spokes.end(), [&](const Spoke& s) { return s.angle != first->angle; });
    for (const bool rising : {!begins, begins})
      std::copy_if(first, next, std::back_inserter(around), [&](const Spoke& s) { return s.rising == rising; });
    first = next;
  }
  std::vector<Wedge> wedges;
  std::vector<Spoke> begun;
  std::vector<char> ended(around.size(), 0);
  for (std::size_t i = 0; i < 2 * around.size(); ++i) {
    const std::size_t at = i % around.size();
    if (around[at].rising == begins) {
      if (i < around.size()) begun.push_back(around[at]);
    } else if (!begun.empty() && !std::exchange(ended[at], 1)) {
      wedges.push_back({begun.back(), around[at]});
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
