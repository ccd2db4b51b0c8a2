// Bounds of the distances to triangles, a SIMD vector of them at a time. This file is included inside a namespace, once
// for each instruction set.

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, 16>;
using Vec = hn::Vec<Tag>;
constexpr std::size_t kLanes = hn::MaxLanes(Tag());

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

HWY_INLINE Vec3 broadcast(const Eigen::Vector3f& v) {
  const Tag d;
  return {hn::Set(d, v.x()), hn::Set(d, v.y()), hn::Set(d, v.z())};
}

struct Bounds {
  Vec lower, upper;
};

/// Computes the bounds of the distances from the origin to the triangles with the corners a, b and c.
///
/// The error of a computed distance is bounded by a multiple of the distance to the farthest corner, plus `moved`. For
/// a triangle of little height, whose normal is less accurate, the multiple is greater.
HWY_INLINE Bounds boundsOf(const Vec3& a, const Vec3& b, const Vec3& c, Vec moved) {
  const Tag d;
  constexpr float kRounding = 32 * std::numeric_limits<float>::epsilon();
  const Vec3 ab = minus(b, a), bc = minus(c, b), ca = minus(a, c);
  const Vec abab = dot(ab, ab), bcbc = dot(bc, bc), caca = dot(ca, ca);
  // Sides are divided by the longest one, because the fourth power of a length is soon beyond the range of float.
  // A rough length will do.
  const Vec squaredLongest = hn::Max(hn::Max(abab, bcbc), caca);
  const Vec perLength = hn::ApproximateReciprocalSqrt(squaredLongest);
  const auto unit = [&](const Vec3& v) HWY_ATTR {
    return Vec3{hn::Mul(v.x, perLength), hn::Mul(v.y, perLength), hn::Mul(v.z, perLength)};
  };
  const Vec3 n = cross(unit(ab), unit(bc));
  const Vec perNormal = hn::Div(hn::Set(d, 1.0F), hn::Sqrt(dot(n, n)));
  const auto outside = [&](const Vec3& corner, const Vec3& side)
                           HWY_ATTR { return hn::Lt(dot(n, cross(corner, side)), hn::Zero(d)); };
  const auto isOutside = hn::Or(hn::Or(outside(a, ab), outside(b, bc)), outside(c, ca));
  const Vec toSides =
      hn::Min(hn::Min(squaredToSegment(a, ab, abab), squaredToSegment(b, bc, bcbc)), squaredToSegment(c, ca, caca));
  const Vec distance = hn::IfThenElse(isOutside, hn::Sqrt(toSides), hn::Mul(hn::Abs(dot(n, a)), perNormal));
  // No corner is farther than the nearest point of the triangle plus the longest side.
  const Vec farthest = hn::Add(hn::MulAdd(squaredLongest, perLength, distance), moved);
  const Vec error = hn::Mul(hn::Mul(hn::Set(d, kRounding), farthest), perNormal);
  return {hn::Sub(distance, error), hn::Add(distance, error)};
}
