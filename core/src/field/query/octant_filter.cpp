#include "field/query/octant_filter.h"

#include <algorithm>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "field/query/octant_filter.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include to follow foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hpsdf::query {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

std::uint32_t keepInOctantOnTarget(const std::uint8_t* octants, int octant, std::uint32_t* triangles,
                                   std::uint32_t count) {
  using Tag = hn::CappedTag<std::uint32_t, kFilterWidth>;
  constexpr std::size_t kLanes = hn::MaxLanes(Tag());
  const Tag d;
  const hn::Rebind<std::uint8_t, Tag> bytes;
  const auto bit = hn::Set(d, std::uint32_t{1} << octant);
  std::size_t kept = 0, i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    const auto matters = hn::TestBit(hn::PromoteTo(d, hn::LoadU(bytes, octants + i)), bit);
    kept += hn::CompressStore(hn::LoadU(d, triangles + i), matters, d, triangles + kept);
  }
  if (i == count) return static_cast<std::uint32_t>(kept);
  HWY_ALIGN std::uint8_t last[kFilterWidth] = {};  // a load from `octants` could pass the end of the list
  std::copy_n(octants + i, count - i, last);
  const auto matters = hn::TestBit(hn::PromoteTo(d, hn::Load(bytes, last)), bit);
  kept += hn::CompressStore(hn::LoadU(d, triangles + i), matters, d, triangles + kept);
  return static_cast<std::uint32_t>(kept);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace hpsdf::query
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hpsdf::query {

HWY_EXPORT(keepInOctantOnTarget);

std::uint32_t keepInOctant(const std::uint8_t* octants, int octant, std::uint32_t* triangles, std::uint32_t count) {
  return HWY_DYNAMIC_DISPATCH(keepInOctantOnTarget)(octants, octant, triangles, count);
}

}  // namespace hpsdf::query
#endif
