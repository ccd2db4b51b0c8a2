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

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, 16>;
using Vec = hn::Vec<Tag>;
constexpr std::size_t kLanes = hn::MaxLanes(Tag());
static_assert(TriangleChunk::kSize % kLanes == 0);

struct Vec3 {
  Vec x, y, z;
};

HWY_INLINE Vec3 minus(const Vec3& a, const Vec3& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE Vec dot(const Vec3& a, const Vec3& b) {
  return hn::MulAdd(a.z, b.z, hn::MulAdd(a.y, b.y, hn::Mul(a.x, b.x)));
}
HWY_INLINE Vec3 cross(const Vec3& a, const Vec3& b) {
  return {hn::NegMulAdd(a.z, b.y, hn::Mul(a.y, b.z)), hn::NegMulAdd(a.x, b.z, hn::Mul(a.z, b.x)),
          hn::NegMulAdd(a.y, b.x, hn::Mul(a.x, b.y))};
}

/// Returns 1/a, or NaN for 0. An approximation with a step of Newton's method is accurate to a few units in the last
/// place and takes a fraction of the time of a division.
HWY_INLINE Vec reciprocal(Vec a) {
  const Vec approximate = hn::ApproximateReciprocal(a);
  return hn::Mul(approximate, hn::NegMulAdd(a, approximate, hn::Set(Tag(), 2.0F)));
}

/// Returns the squared distance from the origin to the segment that begins at `from` with the direction `along`.
HWY_INLINE Vec squaredToSegment(const Vec3& from, const Vec3& along, Vec squaredLength) {
  const Tag d;
  const Vec t =
      hn::Min(hn::Max(hn::Mul(hn::Neg(dot(from, along)), reciprocal(squaredLength)), hn::Zero(d)), hn::Set(d, 1.0F));
  const Vec3 to = {hn::MulAdd(t, along.x, from.x), hn::MulAdd(t, along.y, from.y), hn::MulAdd(t, along.z, from.z)};
  return dot(to, to);
}

/// Computes the bounds of the distances from `point` or, if `Moves` is false, from the origin.
///
/// The error of a computed distance is bounded by a multiple of the distance to the farthest corner. For a triangle of
/// little height, whose normal is less accurate, the multiple is greater.
template <bool Moves>
HWY_INLINE void findBoundsFrom(TriangleChunk& chunk, const Eigen::Vector3f& point) {
  const Tag d;
  const Vec3 origin = {hn::Set(d, point.x()), hn::Set(d, point.y()), hn::Set(d, point.z())};
  const Vec moved = hn::Set(d, Moves ? point.norm() : 0.0F);
  constexpr float kRounding = 32 * std::numeric_limits<float>::epsilon();
  for (std::size_t i = 0; i < chunk.count; i += kLanes) {
    const auto load = [&](int corner) HWY_ATTR {
      Vec3 v;
      Vec unused;
      hn::LoadInterleaved4(d, chunk.corners[corner][i].data(), v.x, v.y, v.z, unused);
      return Moves ? minus(v, origin) : v;
    };
    const Vec3 a = load(0), b = load(1), c = load(2);
    const Vec3 ab = minus(b, a), bc = minus(c, b), ca = minus(a, c);
    const Vec abab = dot(ab, ab), bcbc = dot(bc, bc), caca = dot(ca, ca);
    // Sides are divided by the longest one, because the fourth power of a length is soon beyond the range of float.
    // A rough length will do.
    const Vec perLength = hn::ApproximateReciprocalSqrt(hn::Max(hn::Max(abab, bcbc), caca));
    const auto unit = [&](const Vec3& v) HWY_ATTR {
      return Vec3{hn::Mul(v.x, perLength), hn::Mul(v.y, perLength), hn::Mul(v.z, perLength)};
    };
    const Vec3 n = cross(unit(ab), unit(bc));
    const Vec perNormal = hn::Div(hn::Set(d, 1.0F), hn::Sqrt(dot(n, n)));
    const auto outside = [&](const Vec3& corner, const Vec3& side)
                             HWY_ATTR { return hn::Lt(dot(n, cross(corner, unit(side))), hn::Zero(d)); };
    const auto isOutside = hn::Or(hn::Or(outside(a, ab), outside(b, bc)), outside(c, ca));
    const Vec toSides =
        hn::Min(hn::Min(squaredToSegment(a, ab, abab), squaredToSegment(b, bc, bcbc)), squaredToSegment(c, ca, caca));
    const Vec distance = hn::IfThenElse(isOutside, hn::Sqrt(toSides), hn::Mul(hn::Abs(dot(n, a)), perNormal));
    const Vec farthest = hn::Add(hn::Sqrt(hn::Max(hn::Max(dot(a, a), dot(b, b)), dot(c, c))), moved);
    const Vec error = hn::Mul(hn::Mul(hn::Set(d, kRounding), farthest), perNormal);
    hn::Store(hn::Sub(distance, error), d, chunk.lower.data() + i);
    hn::Store(hn::Add(distance, error), d, chunk.upper.data() + i);
  }
}

void findBoundsOnTarget(TriangleChunk& chunk) { findBoundsFrom<false>(chunk, Eigen::Vector3f::Zero()); }

void findMovedBoundsOnTarget(TriangleChunk& chunk, const Eigen::Vector3f& point) { findBoundsFrom<true>(chunk, point); }

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace hpsdf::mesh
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hpsdf::mesh {

HWY_EXPORT(findBoundsOnTarget);
HWY_EXPORT(findMovedBoundsOnTarget);

void fillLastVector(TriangleChunk& chunk) {
  constexpr std::size_t kMostLanes = 16;
  for (std::size_t i = chunk.count; i % kMostLanes != 0; ++i)
    for (auto& corner : chunk.corners) corner[i] = corner[chunk.count - 1];
}

void findBounds(TriangleChunk& chunk) { HWY_DYNAMIC_DISPATCH(findBoundsOnTarget)(chunk); }

void findBounds(TriangleChunk& chunk, const Eigen::Vector3f& point) {
  HWY_DYNAMIC_DISPATCH(findMovedBoundsOnTarget)(chunk, point);
}

}  // namespace hpsdf::mesh
#endif
