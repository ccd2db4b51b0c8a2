#include "sign/angle_block.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sign/angle_block.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include to follow foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hpsdf::sign {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<double, bvh::kWidth>;
using Vec = hn::Vec<Tag>;
using Mask = hn::Mask<Tag>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Tag()));

struct Vec3 {
  Vec x, y, z;
};

// Multiplications and additions are not fused, so that all instruction sets round alike.
HWY_INLINE Vec dot(const Vec3& a, const Vec3& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE Vec3 cross(const Vec3& a, const Vec3& b) {
  return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)), hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
          hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}

/// Adds the angles of the complex numbers x + iy where `counts` is set, as `AngleSum::add` does.
HWY_INLINE void addAngles(Mask counts, Vec x, Vec y, int place, BlockAngles& sum) {
  const Tag d;
  const Vec zero = hn::Zero(d), one = hn::Set(d, 1);
  const Vec oldReal = hn::Load(d, sum.real + place), oldImaginary = hn::Load(d, sum.imaginary + place);
  const Vec real = hn::Sub(hn::Mul(oldReal, x), hn::Mul(oldImaginary, y));
  const Vec imaginary = hn::Add(hn::Add(hn::Mul(oldReal, y), hn::Mul(oldImaginary, x)), zero);
  const Mask wasBelow = hn::Lt(oldImaginary, zero), isBelow = hn::Lt(imaginary, zero);
  const Mask rises = hn::And(hn::Gt(y, zero), hn::AndNot(wasBelow, isBelow));
  const Mask falls = hn::And(hn::Lt(y, zero), hn::AndNot(isBelow, wasBelow));
  const Mask isHalfTurn = hn::And(hn::Eq(y, zero), hn::Lt(x, zero));
  const Mask startsAbove =
      hn::Or(hn::Gt(oldImaginary, zero), hn::And(hn::Eq(oldImaginary, zero), hn::Lt(oldReal, zero)));
  const Mask addsTurn = hn::And(counts, hn::Or(rises, hn::And(isHalfTurn, startsAbove)));
  const Vec turns = hn::Add(hn::Load(d, sum.turns + place), hn::IfThenElseZero(addsTurn, one));
  hn::Store(hn::Sub(turns, hn::IfThenElseZero(hn::And(counts, falls), one)), d, sum.turns + place);
  const Vec size = hn::Add(hn::Abs(real), hn::Abs(imaginary));
  const Vec large = hn::Set(d, 1e100), small = hn::Set(d, 1e-100);
  const Vec scale = hn::IfThenElse(hn::Lt(size, small), large, hn::IfThenElse(hn::Gt(size, large), small, one));
  hn::Store(hn::IfThenElse(counts, hn::Mul(scale, real), oldReal), d, sum.real + place);
  hn::Store(hn::IfThenElse(counts, hn::Mul(scale, imaginary), oldImaginary), d, sum.imaginary + place);
}

void addBlock(const AngleBlock& block, const Vector3& origin, BlockAngles& sum) {
  const Tag d;
  for (int place = 0; place < bvh::kWidth; place += kLanes) {
    Vec3 v[3];
    for (int k = 0; k < 3; ++k)
      v[k] = {hn::Sub(hn::Load(d, block.corner[k][0] + place), hn::Set(d, origin.x())),
              hn::Sub(hn::Load(d, block.corner[k][1] + place), hn::Set(d, origin.y())),
              hn::Sub(hn::Load(d, block.corner[k][2] + place), hn::Set(d, origin.z()))};
    const auto& [a, b, c] = v;
    const Vec la = hn::Sqrt(dot(a, a)), lb = hn::Sqrt(dot(b, b)), lc = hn::Sqrt(dot(c, c));
    const Vec product = hn::Mul(hn::Mul(la, lb), lc);
    const Vec dots = hn::Add(hn::Add(hn::Mul(dot(a, b), lc), hn::Mul(dot(b, c), la)), hn::Mul(dot(c, a), lb));
    const Vec x = hn::Add(hn::Set(d, 1), hn::Div(dots, product)), y = hn::Div(dot(a, cross(b, c)), product);
    const Mask isZero = hn::And(hn::Eq(x, hn::Zero(d)), hn::Eq(y, hn::Zero(d)));
    addAngles(hn::AndNot(isZero, hn::Gt(product, hn::Zero(d))), x, y, place, sum);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace hpsdf::sign
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hpsdf::sign {

HWY_EXPORT(addBlock);

void addHalfSolidAngles(const AngleBlock& block, const Vector3& x, BlockAngles& sum) {
  HWY_DYNAMIC_DISPATCH(addBlock)(block, x, sum);
}

}  // namespace hpsdf::sign
#endif
