#include "distance/exact_leaf_signs.h"

#include <algorithm>
#include <atomic>

#include "surface/crossings.h"

namespace hpsdf::distance {

bool ExactLeafSigns::any() const {
  return insideTest_ == InsideTest::pseudonormal || insideTest_ == InsideTest::shell ||
         (insideTest_ == InsideTest::winding && winding_.isClosed());
}

std::optional<ExactSign> ExactLeafSigns::find(const Vector3& centre, const std::function<bool()>& isCrossed,
                                              std::span<const std::uint32_t> slots) const {
  if (!any()) return std::nullopt;
  if (insideTest_ == InsideTest::pseudonormal) return ExactSign::pseudonormal;
  if (insideTest_ == InsideTest::shell) return ExactSign::positive;
  if (!isCrossed()) return winding_.isInside(centre) ? ExactSign::negative : ExactSign::positive;
  const auto allAre = [&](Sides sides) {
    return std::ranges::all_of(slots, [&](std::uint32_t slot) { return sidesOf(slot) == sides; });
  };
  if (allAre(Sides::separates)) return ExactSign::pseudonormal;
  if (allAre(Sides::bothInside)) return ExactSign::negative;
  return std::nullopt;
}

void ExactLeafSigns::prepare() const {
  normals_.emplace(hierarchy_);
  const Crossings crossings = surface::findCrossings(hierarchy_, kMaxCrossings, kTooNear, {});
  std::vector<bool> crosses(hierarchy_.frames().size(), !crossings.complete);
  for (const Crossing& crossing : crossings.found)
    for (const std::uint32_t triangle : crossing.triangles) crosses[triangle] = true;
  known_.assign(crosses.size(), 0);
  for (std::size_t slot = 0; slot < known_.size(); ++slot)
    if (crosses[hierarchy_.frames()[slot].triangle]) known_[slot] = 1 + static_cast<int>(Sides::unknown);
}

ExactLeafSigns::Sides ExactLeafSigns::sidesOf(std::uint32_t slot) const {
  std::call_once(isPrepared_, [&] { prepare(); });
  const std::atomic_ref known(known_[slot]);
  if (known == 0) {
    const bool isCertain = bvh::hasArea(hierarchy_.frames()[slot]) && !sign::isSharp(hierarchy_, *normals_, slot);
    known = static_cast<std::uint8_t>(1 + static_cast<int>(isCertain ? winding_.sidesOf(slot) : Sides::unknown));
  }
  return static_cast<Sides>(known.load() - 1);
}

}  // namespace hpsdf::distance
