#include "mesh/bodies.h"

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

/// Of an edge: those sides whose patch has others there that run back, and so many of the patch's, are left out.
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

/// Counterclockwise as the edge comes towards the eye. Of faces in one plane those that rise come first, so that bodies
/// which touch there are not within each other; and all orders are the opposite ones along the edge's other direction.
void sortAround(std::vector<Spoke>& spokes) {
  std::ranges::sort(spokes, {}, &Spoke::angle);
  const auto before = [](const Spoke& a, const Spoke& b) {
    if (a.rising != b.rising) return a.rising;
    return a.rising ? a.patch > b.patch : a.patch < b.patch;
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
  sortAround(spokes);
  return spokes;
}

using Wedge = std::array<Spoke, 2>;

/// The solids at an edge, each from where it falls to where it rises; as many do the one as the other.
std::vector<Wedge> wedgesOf(const std::vector<Spoke>& spokes) {
  std::vector<Wedge> wedges;
  std::vector<Spoke> falling;  // whose solid has not ended
  std::vector<char> ended(spokes.size(), 0);
  for (std::size_t i = 0; i < 2 * spokes.size(); ++i) {
    const std::size_t at = i % spokes.size();
    if (!spokes[at].rising) {
      if (i < spokes.size()) falling.push_back(spokes[at]);
    } else if (!falling.empty() && !std::exchange(ended[at], 1)) {
      wedges.push_back({falling.back(), spokes[at]});
      falling.pop_back();
    }
  }
  return wedges;
}

/// Joins patches that have a solid between them. Where that would make walls a body without a volume, as where solids
/// that touch all look inwards, all are one.
void joinSolids(const std::vector<Wedge>& wedges, FaceSets& together) {
  const bool flat = std::ranges::any_of(wedges, [](const Wedge& w) { return w[0].angle == w[1].angle; });
  for (const auto& [from, to] : wedges) {
    together.join(from.patch, to.patch);
    if (flat) together.join(wedges.front()[0].patch, to.patch);
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
    if (2 * rising == left.size()) return joinSolids(wedgesOf(spokesOf(mesh, patches, left)), together);
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
