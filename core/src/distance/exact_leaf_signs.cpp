#include "distance/exact_leaf_signs.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "bvh/search.h"
#include "surface/crossings.h"

namespace hpsdf::distance {
namespace {

/// Powers of the inverse of the real solution of t³ = t + 1. Multiples of this vector spread evenly in a cube.
const Vector3 kIrregular(0.8191725133961645, 0.6710436067037893, 0.5497004779019703);

}  // namespace

bool ExactLeafSigns::any() const {
  return insideTest_ == InsideTest::pseudonormal || insideTest_ == InsideTest::shell ||
         insideTest_ == InsideTest::winding;
}

std::optional<LeafSign> ExactLeafSigns::find(const Box& box, const std::function<bool()>& isCrossed,
                                             std::span<const std::uint32_t> slots) const {
  if (!any()) return std::nullopt;
  if (insideTest_ == InsideTest::pseudonormal) return LeafSign{ExactSign::pseudonormal};
  if (insideTest_ == InsideTest::shell) return LeafSign{ExactSign::positive};
  if (!isFarFromHoles(box)) return std::nullopt;
  if (!isCrossed()) return LeafSign{winding_.isInside(box.center()) ? ExactSign::negative : ExactSign::positive};
  const auto allAre = [&](Sides sides) {
    return std::ranges::all_of(slots, [&](std::uint32_t slot) { return sidesOf(slot) == sides; });
  };
  if (allAre(Sides::separates)) return LeafSign{ExactSign::pseudonormal};
  if (allAre(Sides::bothInside)) return LeafSign{ExactSign::negative};
  const std::optional<WindingReference> reference = referenceIn(box);
  return reference ? std::optional(LeafSign{ExactSign::winding, *reference}) : std::nullopt;
}

/// Returns true if every surface that closes a hole is certainly farther from all points of a box than the triangles.
/// The winding number that shows it is taken beside the centre of the box, because the centres of cells may lie on
/// edges of the mesh, where rounding spoils it.
bool ExactLeafSigns::isFarFromHoles(const Box& box) const {
  if (winding_.isClosed()) return true;
  constexpr double kAside = 1.0 / 16;
  const double radius = box.sizes().norm() / 2;
  const Vector3 point = box.center() + kAside * radius * kIrregular.normalized();
  const double distance = bvh::distanceTo(hierarchy_, point);
  return distance > leastFromTriangles() && winding_.isFarFromHoles(point, (1 + kAside) * radius, distance);
}

/// Returns the distance from the triangles above which a point keeps its side when its coordinates are rounded to
/// floats.
double ExactLeafSigns::leastFromTriangles() const {
  return 4 * std::numeric_limits<float>::epsilon() / hierarchy_.scale();
}

/// Returns a reference point in a box, the farthest from the triangles out of a few. Segments from it to points that
/// queries and pictures ask for, such as centres of cells, should not run along edges. So the places are irregular.
/// Returns std::nullopt if the point may change its side when its offset from a vertex is rounded to floats.
std::optional<WindingReference> ExactLeafSigns::referenceIn(const Box& box) const {
  constexpr int kPlaces = 4;
  double farthest = leastFromTriangles();
  WindingReference reference;
  bool isFound = false;
  for (int place = 1; place <= kPlaces; ++place) {
    const Vector3 share = (place * kIrregular).unaryExpr([](double s) { return s - std::floor(s); });
    const Vector3 point = box.min() + share.cwiseProduct(box.sizes());
    const double distance = bvh::distanceTo(hierarchy_, point);
    if (!(distance > farthest)) continue;
    farthest = distance;
    reference.point = point;
    isFound = true;
  }
  if (!isFound) return std::nullopt;
  reference.winding = winding_.windingAt(reference.point);
  return reference;
}

void ExactLeafSigns::prepare() const {
  normals_.emplace(hierarchy_);
  const Crossings crossings = surface::findCrossings(hierarchy_, kMaxCrossings, kTooNear, {});
  std::vector<bool> crosses(hierarchy_.triangles().size(), !crossings.complete);
  for (const Crossing& crossing : crossings.found)
    for (const std::uint32_t triangle : crossing.triangles) crosses[triangle] = true;
  known_.assign(crosses.size(), 0);
  for (std::size_t slot = 0; slot < known_.size(); ++slot)
    if (crosses[hierarchy_.numbers()[slot]]) known_[slot] = 1 + static_cast<int>(Sides::unknown);
}

ExactLeafSigns::Sides ExactLeafSigns::sidesOf(std::uint32_t slot) const {
  std::call_once(isPrepared_, [&] { prepare(); });
  const std::atomic_ref known(known_[slot]);
  if (known == 0) {
    const bool isCertain = bvh::hasArea(hierarchy_.frame(slot)) && !sign::isSharp(hierarchy_, *normals_, slot);
    known = static_cast<std::uint8_t>(1 + static_cast<int>(isCertain ? winding_.sidesOf(slot) : Sides::unknown));
  }
  return static_cast<Sides>(known.load() - 1);
}

}  // namespace hpsdf::distance
