#include "mesh/triangle_bounds.h"

#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/triangle_bounds.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include to follow foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hpsdf::mesh {
namespace HWY_NAMESPACE {
namespace {

#include "mesh/triangle_bounds-inl.h"

static_assert(TriangleChunk::kSize % TriangleChunk::kMostLanes == 0 && kLanes <= TriangleChunk::kMostLanes);

/// Computes the bounds of the distances from `point` or, if `Moves` is false, from the origin.
template <bool Moves>
HWY_INLINE float findBoundsFrom(TriangleChunk& chunk, const Eigen::Vector3f& point) {
  const Tag d;
  const Vec3 origin = broadcast(point);
  const Vec moved = hn::Set(d, Moves ? point.norm() : 0.0F);
  Vec least = hn::Set(d, std::numeric_limits<float>::infinity());
  for (std::size_t i = 0; i < chunk.count; i += kLanes) {
    const auto load = [&](int corner) HWY_ATTR {
      const auto& from = chunk.corners[corner];
      const Vec3 v = {hn::Load(d, &from[0][i]), hn::Load(d, &from[1][i]), hn::Load(d, &from[2][i])};
      return Moves ? minus(v, origin) : v;
    };
    const auto [lower, upper] = boundsOf(load(0), load(1), load(2), moved);
    hn::Store(lower, d, chunk.lower.data() + i);
    least = hn::IfThenElse(hn::Lt(upper, least), upper, least);
  }
  return hn::GetLane(hn::MinOfLanes(d, least));
}

float findBoundsOnTarget(TriangleChunk& chunk) { return findBoundsFrom<false>(chunk, Eigen::Vector3f::Zero()); }

float findMovedBoundsOnTarget(TriangleChunk& chunk, const Eigen::Vector3f& point) {
  return findBoundsFrom<true>(chunk, point);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace hpsdf::mesh
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hpsdf::mesh {

HWY_EXPORT(findBoundsOnTarget);
HWY_EXPORT(findMovedBoundsOnTarget);

void fillLastVector(TriangleChunk& chunk) {
  for (std::size_t i = chunk.count; i % TriangleChunk::kMostLanes != 0; ++i)
    for (auto& corner : chunk.corners)
      for (auto& coordinate : corner) coordinate[i] = coordinate[chunk.count - 1];
}

float findBounds(TriangleChunk& chunk) { return HWY_DYNAMIC_DISPATCH(findBoundsOnTarget)(chunk); }

float findBounds(TriangleChunk& chunk, const Eigen::Vector3f& point) {
  return HWY_DYNAMIC_DISPATCH(findMovedBoundsOnTarget)(chunk, point);
}

}  // namespace hpsdf::mesh
#endif
