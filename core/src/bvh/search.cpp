#include "bvh/search.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bvh/search.cpp"
#include <hwy/foreach_target.h>
// Highway requires that these headers come after foreach_target.h.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hpsdf::bvh {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// Capacity of the traversal's stack. The tree has at most 64 levels (see `makeTriangleTree`). Each level leaves at
/// most three children on the stack, and four more entries are written above the top of the stack.
constexpr std::size_t kStackSize = 3 * 64 + 8;

template <class V>
struct Point {
  V x, y, z;
};

template <class D>
struct SquaredBounds {
  hn::Vec<D> lower, upper;
};

/// Returns the squared distance from a point to an oriented box; `field(i)` is the i-th field of `Node` for this box.
template <class D, class Fields>
HWY_INLINE hn::Vec<D> boxDistance(D d, const Point<hn::Vec<D>>& p, const Fields& field) {
  const auto wx = p.x - field(Node::center), wy = p.y - field(Node::center + 1), wz = p.z - field(Node::center + 2);
  auto sum = hn::Zero(d);
  for (int axis = 0; axis < 3; ++axis) {
    const int a = Node::axes + 3 * axis;
    const auto along = hn::MulAdd(wz, field(a + 2), hn::MulAdd(wy, field(a + 1), wx * field(a)));
    const auto beyond = hn::Max(hn::Abs(along) - field(Node::half + axis), hn::Zero(d));
    sum = hn::MulAdd(beyond, beyond, sum);
  }
  return sum;
}

/// Returns bounds of the squared distance from a point to a triangle; `field(i)` is the i-th field of `Block` for
/// this triangle. The bounds allow for rounding within this function, but not for rounding the coordinates of the
/// point and the triangle to float.
template <class D, class Fields>
HWY_INLINE SquaredBounds<D> triangleDistance(D d, const Point<hn::Vec<D>>& point, const Fields& field) {
  const auto zero = hn::Zero(d);
  const auto one = hn::Set(d, 1.0f);
  const auto unit = [&](auto t) HWY_ATTR { return hn::Min(hn::Max(t, zero), one); };
  const auto wx = point.x - field(Block::origin), wy = point.y - field(Block::origin + 1),
             wz = point.z - field(Block::origin + 2);
  const auto dot = [&](int f)
                       HWY_ATTR { return hn::MulAdd(wz, field(f + 2), hn::MulAdd(wy, field(f + 1), wx * field(f))); };
  const auto p = dot(Block::along), q = dot(Block::across);
  const auto length = field(Block::length), apexAlong = field(Block::apexAlong), apexAcross = field(Block::apexAcross);

  const auto base = p - hn::Min(hn::Max(p, zero), length);
  const auto left = unit(hn::MulAdd(p, apexAlong, q * apexAcross) * field(Block::inverseLeft));
  const auto leftP = hn::NegMulAdd(left, apexAlong, p), leftQ = hn::NegMulAdd(left, apexAcross, q);
  const auto fromB = p - length, rightAlong = apexAlong - length;
  const auto right = unit(hn::MulAdd(fromB, rightAlong, q * apexAcross) * field(Block::inverseRight));
  const auto rightP = hn::NegMulAdd(right, rightAlong, fromB), rightQ = hn::NegMulAdd(right, apexAcross, q);
  // Because of rounding, a point beyond a sharp corner may seem to lie on the inner side of both edges at this corner.
  // The condition `base == zero`, that the point projects onto the base of the triangle, excludes such points.
  const auto inside = hn::And(hn::And(q > zero, base == zero),
                              hn::And(p * apexAcross > q * apexAlong, q * rightAlong > fromB * apexAcross));
  const auto side = hn::Min(hn::MulAdd(base, base, q * q), hn::Min(hn::MulAdd(leftP, leftP, leftQ * leftQ),
                                                                   hn::MulAdd(rightP, rightP, rightQ * rightQ)));
  const auto fromOrigin = hn::MulAdd(wz, wz, hn::MulAdd(wy, wy, wx * wx));
  const auto height = hn::Max(hn::NegMulAdd(q, q, hn::NegMulAdd(p, p, fromOrigin)), zero);
  const auto squared = height + hn::IfThenZeroElse(inside, side);
  const auto rounding = hn::Set(d, 32 * 6e-8f) * fromOrigin;
  return {squared - rounding, squared + rounding};
}

/// Returns the squared distance above which a triangle or box cannot be the nearest: (√upper + delta)². Here `upper` is
/// an upper bound of the squared distance to any one triangle, and `delta` allows for rounding.
template <class D>
HWY_INLINE hn::Vec<D> limitFrom(D d, hn::Vec<D> upper, float delta) {
  const auto distance = hn::Sqrt(upper) + hn::Set(d, delta);
  return distance * distance * hn::Set(d, 1.000001f);
}

/// Frames of up to four triangles, with the fields of `TriangleFrame`.
struct Frames {
  enum Field {
    origin = 0,
    along = 3,
    across = 6,
    normal = 9,
    length = 12,
    apexAlong,
    apexAcross,
    inverseLeft,
    inverseRight,
    firstCorner,
    fields
  };
  HWY_ALIGN double field[fields][kWidth];
};

template <class V>
HWY_INLINE V dot(const Point<V>& a, const Point<V>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class V>
HWY_INLINE Point<V> cross(const Point<V>& a, const Point<V>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class V>
HWY_INLINE Point<V> minus(const Point<V>& a, const Point<V>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

template <class V>
HWY_INLINE Point<V> divided(const Point<V>& a, V by) {
  return {a.x / by, a.y / by, a.z / by};
}

/// Makes the frames of the triangles with these corners, as `makeFrame` in triangle_frame.cpp does and with the same
/// bits: `corner[k][axis][i]` belongs to triangle i. Returns false if a triangle has no area, or so small a
/// one that its frame has to be made by `makeFrame`.
HWY_INLINE bool makeFrames(const double corner[3][3][kWidth], Frames& frames) {
  const hn::CappedTag<double, kWidth> d;
  using V = hn::Vec<decltype(d)>;
  const auto zero = hn::Zero(d);
  bool areRegular = true;
  for (std::size_t at = 0; at < kWidth; at += hn::MaxLanes(d)) {
    const auto load = [&](int k) HWY_ATTR {
      return Point<V>{hn::Load(d, corner[k][0] + at), hn::Load(d, corner[k][1] + at), hn::Load(d, corner[k][2] + at)};
    };
    const Point<V> p = load(0), q = load(1), r = load(2);
    const Point<V> pq = minus(q, p), qr = minus(r, q), rp = minus(p, r);
    const V first = dot(pq, pq), second = dot(qr, qr), third = dot(rp, rp);
    const auto isSecond = second > first;
    const auto isThird = third > hn::Max(first, second);
    const auto choose = [&](const Point<V>& byFirst, const Point<V>& bySecond, const Point<V>& byThird) HWY_ATTR {
      const auto one = [&](V v1, V v2, V v3)
                           HWY_ATTR { return hn::IfThenElse(isThird, v3, hn::IfThenElse(isSecond, v2, v1)); };
      return Point<V>{one(byFirst.x, bySecond.x, byThird.x), one(byFirst.y, bySecond.y, byThird.y),
                      one(byFirst.z, bySecond.z, byThird.z)};
    };
    const Point<V> a = choose(p, q, r), c = choose(r, p, q), base = choose(pq, qr, rp), apex = minus(c, a);
    const V length = hn::Sqrt(hn::Max(first, hn::Max(second, third)));
    const Point<V> along = divided(base, length);
    const auto withoutBase = [&](const Point<V>& v) HWY_ATTR {
      const V part = dot(along, v);
      return Point<V>{v.x - along.x * part, v.y - along.y * part, v.z - along.z * part};
    };
    const Point<V> across0 = withoutBase(cross(along, apex));
    const V height = hn::Sqrt(dot(across0, across0));
    const auto largestOf = [&](const Point<V>& v)
                               HWY_ATTR { return hn::Max(hn::Abs(v.x), hn::Max(hn::Abs(v.y), hn::Abs(v.z))); };
    const V size = hn::Max(largestOf(p), hn::Max(largestOf(q), largestOf(r)));
    const Point<V> tilted = withoutBase(divided(across0, height));
    const Point<V> normal = divided(tilted, hn::Sqrt(dot(tilted, tilted)));
    const Point<V> across = cross(normal, along);
    const V apexAlong = hn::Min(hn::Max(dot(along, apex), zero), length), apexAcross = dot(across, apex);
    const V rest = apexAlong - length;
    const V left = apexAlong * apexAlong + apexAcross * apexAcross, right = rest * rest + apexAcross * apexAcross;
    const V one = hn::Set(d, 1.0), least = hn::Set(d, std::numeric_limits<double>::min());
    areRegular =
        areRegular && hn::AllTrue(d, hn::And(height > hn::Set(d, kFlat) * size, hn::Min(left, right) >= least));
    const auto store = [&](int field, V value) HWY_ATTR { hn::Store(value, d, frames.field[field] + at); };
    const auto storePoint = [&](int field, const Point<V>& v) HWY_ATTR {
      store(field, v.x);
      store(field + 1, v.y);
      store(field + 2, v.z);
    };
    storePoint(Frames::origin, a);
    storePoint(Frames::along, along);
    storePoint(Frames::across, across);
    storePoint(Frames::normal, normal);
    store(Frames::length, length);
    store(Frames::apexAlong, apexAlong);
    store(Frames::apexAcross, apexAcross);
    store(Frames::inverseLeft, one / left);
    store(Frames::inverseRight, one / right);
    store(Frames::firstCorner, hn::IfThenElse(isThird, hn::Set(d, 2.0), hn::IfThenElseZero(isSecond, one)));
  }
  return areRegular;
}

/// Sets lane i of `frames` to a frame.
inline void setFrame(Frames& frames, int i, const TriangleFrame& frame) {
  const auto set = [&](int field, double value) { frames.field[field][i] = value; };
  for (int axis = 0; axis < 3; ++axis) {
    set(Frames::origin + axis, frame.origin[axis]);
    set(Frames::along + axis, frame.along[axis]);
    set(Frames::across + axis, frame.across[axis]);
    set(Frames::normal + axis, frame.normal[axis]);
  }
  set(Frames::length, frame.length);
  set(Frames::apexAlong, frame.apexAlong);
  set(Frames::apexAcross, frame.apexAcross);
  set(Frames::inverseLeft, frame.inverseSquaredLeft);
  set(Frames::inverseRight, frame.inverseSquaredRight);
  set(Frames::firstCorner, frame.firstCorner);
}

/// Makes the frames of the triangles in up to four slots. Unused lanes repeat the last one.
HWY_INLINE void framesOf(const Hierarchy& hierarchy, const std::uint32_t* slots, int count, Frames& frames) {
  HWY_ALIGN double corner[3][3][kWidth];
  const Triangle* const triangles = hierarchy.triangles().data();
  const Vector3* const vertices = hierarchy.vertices().data();
  for (int i = 0; i < kWidth; ++i) {
    const Triangle& triangle = triangles[slots[std::min(i, count - 1)]];
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis) corner[k][axis][i] = vertices[triangle[k]][axis];
  }
  if (makeFrames(corner, frames)) return;
  for (int i = 0; i < count; ++i) setFrame(frames, i, hierarchy.frame(slots[i]));
}

/// The result of `locateLanes` for each lane: the squared distance to a triangle, and the members of `FramePoint`.
template <class D>
struct Located {
  hn::Vec<D> squared, height, side[3], inside;
};

/// Locates one point per lane relative to a triangle, whose frame is lane i of `frames`, as `locate` in
/// triangle_frame.h does. Both functions perform the same operations in the same order, without fused multiply-add, so
/// that every instruction set yields the same bits.
template <class D>
HWY_INLINE Located<D> locateLanes(D d, const Frames& frames, int i, const Point<hn::Vec<D>>& point) {
  const auto field = [&](int f) HWY_ATTR { return hn::Set(d, frames.field[f][i]); };
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0);
  const auto unit = [&](auto t) HWY_ATTR { return hn::Min(hn::Max(t, zero), one); };
  const auto wx = point.x - field(Frames::origin), wy = point.y - field(Frames::origin + 1),
             wz = point.z - field(Frames::origin + 2);
  const auto along = [&](int f) HWY_ATTR { return wx * field(f) + wy * field(f + 1) + wz * field(f + 2); };
  const auto p = along(Frames::along), q = along(Frames::across), height = along(Frames::normal);
  const auto length = field(Frames::length), apexAlong = field(Frames::apexAlong),
             apexAcross = field(Frames::apexAcross);

  const auto base = p - hn::Min(hn::Max(p, zero), length);
  const auto left = unit((p * apexAlong + q * apexAcross) * field(Frames::inverseLeft));
  const auto leftP = p - left * apexAlong, leftQ = q - left * apexAcross;
  const auto fromB = p - length, rightAlong = apexAlong - length;
  const auto right = unit((fromB * rightAlong + q * apexAcross) * field(Frames::inverseRight));
  const auto rightP = fromB - right * rightAlong, rightQ = q - right * apexAcross;
  const auto inside = hn::And(q > zero, hn::And(p * apexAcross > q * apexAlong, q * rightAlong > fromB * apexAcross));
  Located<D> at{zero,
                height,
                {base * base + q * q, rightP * rightP + rightQ * rightQ, leftP * leftP + leftQ * leftQ},
                hn::IfThenElseZero(inside, one)};
  at.squared = height * height + hn::IfThenZeroElse(inside, hn::Min(hn::Min(at.side[0], at.side[1]), at.side[2]));
  return at;
}

/// Returns true if lower[i] ≤ limit[i] for any lane i.
template <int Lanes>
HWY_INLINE bool anyInReach(const float* lower, const float* limit) {
  const hn::CappedTag<float, Lanes> d;
  constexpr std::size_t kStep = hn::MaxLanes(d);
  auto within = hn::Load(d, lower) <= hn::Load(d, limit);
  for (std::size_t at = kStep; at < Lanes; at += kStep)
    within = hn::Or(within, hn::Load(d, lower + at) <= hn::Load(d, limit + at));
  return !hn::AllFalse(d, within);
}

/// Computes the distances from the points to the triangle in `slot` in double precision, and keeps it for the points to
/// which it is the nearest so far. Its frame is lane i of `frames`; `lower` holds lower bounds of the squared
/// distances.
template <int Lanes>
HWY_INLINE void tryTriangle(Search<Lanes>& s, const Frames& frames, int i, std::uint32_t slot, const float* lower) {
  const hn::CappedTag<double, Lanes> d;
  constexpr std::size_t kStep = hn::MaxLanes(d);
  const auto triangle = hn::Set(d, static_cast<double>(s.hierarchy.numbers()[slot]));
  for (std::size_t at = 0; at < Lanes; at += kStep) {
    if (!anyInReach<kStep>(lower + at, s.limit + at)) continue;
    const auto found =
        locateLanes(d, frames, i,
                    Point<hn::Vec<decltype(d)>>{hn::Load(d, s.exact[0] + at), hn::Load(d, s.exact[1] + at),
                                                hn::Load(d, s.exact[2] + at)});
    const auto best = hn::Load(d, s.squared + at);
    const auto better =
        hn::Or(found.squared < best, hn::And(found.squared == best, triangle < hn::Load(d, s.triangle + at)));
    if (hn::AllFalse(d, better)) continue;
    const auto keep = [&](double* kept, auto value)
                          HWY_ATTR { hn::Store(hn::IfThenElse(better, value, hn::Load(d, kept + at)), d, kept + at); };
    const auto keepField = [&](double* kept, int f) HWY_ATTR { keep(kept, hn::Set(d, frames.field[f][i])); };
    keep(s.squared, found.squared);
    keep(s.triangle, triangle);
    keep(s.slot, hn::Set(d, static_cast<double>(slot)));
    keep(s.height, found.height);
    for (int side = 0; side < 3; ++side) keep(s.side[side], found.side[side]);
    keep(s.inside, found.inside);
    for (int axis = 0; axis < 3; ++axis) keepField(s.normal[axis], Frames::normal + axis);
    keepField(s.length, Frames::length);
    keepField(s.firstCorner, Frames::firstCorner);
  }
}

/// Computes the distances from the points to the candidate triangles in double precision, keeps the nearest
/// triangle of each point, and empties the list of candidates.
template <int Lanes>
HWY_INLINE void settle(Search<Lanes>& s) {
  std::uint32_t slots[kWidth];
  const float* lower[kWidth];
  int count = 0;
  for (int c = 0; c < s.count; ++c) {
    slots[count] = s.candidates[c];
    lower[count] = s.lower[c];
    count += anyInReach<Lanes>(s.lower[c], s.limit);
    if (count == 0 || (count < kWidth && c + 1 < s.count)) continue;
    Frames frames;
    framesOf(s.hierarchy, slots, count, frames);
    for (int i = 0; i < count; ++i) tryTriangle(s, frames, i, slots[i], lower[i]);
    count = 0;
  }
  s.count = 0;
}

/// Finds the nearest triangles of points that are too far away for single precision. Computes the distances to all
/// triangles in double precision.
template <int Lanes>
void tryAll(Search<Lanes>& s) {
  for (std::uint32_t slot = 0; slot < s.hierarchy.triangles().size(); ++slot) {
    if (s.count == s.kCapacity) settle(s);
    std::fill_n(s.lower[s.count], Lanes, 0.0f);
    s.candidates[s.count++] = slot;
  }
  settle(s);
}

template <int Lanes>
HWY_INLINE bool isSeed(const Search<Lanes>& s, std::uint32_t block) {
  for (int i = 0; i < s.seeds; ++i)
    if (s.seed[i] == block) return true;
  return false;
}

/// Prefetches a node or block that is probably needed next into the cache.
HWY_INLINE void prefetchChild(const Node* nodes, const Block* blocks, std::uint32_t child) {
  constexpr std::size_t kLine = 64;
  static_assert(sizeof(Node) == 4 * kLine && sizeof(Block) % alignof(Block) == 0 && sizeof(Block) > 3 * kLine);
  const char* const begin = child & kBlockBit ? reinterpret_cast<const char*>(blocks + (child & ~kBlockBit))
                                              : reinterpret_cast<const char*>(nodes + child);
  for (std::size_t line = 0; line < 4; ++line) hwy::Prefetch(begin + line * kLine);
}

/// The stack of nodes and blocks that the traversal still has to visit. The children of a node are pushed
/// farthest first, so that the nearest child is popped next.
template <class Entry>
class Stack {
 public:
  bool empty() const { return top_ == 0; }
  const Entry& pop() { return entries_[--top_]; }

  /// Returns space for four entries above the top of the stack. The caller writes entries into this space and
  /// then calls `grow(count)`, which keeps the first `count` of them.
  Entry* room() { return entries_.data() + top_; }
  void grow(int count) { top_ += count; }

 private:
  std::array<Entry, kStackSize> entries_;
  std::size_t top_ = 0;
};

/// Returns the ranks 0 to 3 of a node's four children by descending distance. `key[i]` is the squared distance of child
/// i, or -1 if the child is to be skipped. The comparisons need no branches, most of which would be mispredicted.
HWY_INLINE std::array<int, kWidth> ranksOf(const float* key) {
  static_assert(kWidth == 4);
  const bool over10 = key[1] > key[0], over20 = key[2] > key[0], over30 = key[3] > key[0], over21 = key[2] > key[1],
             over31 = key[3] > key[1], over32 = key[3] > key[2];
  return {over10 + over20 + over30, !over10 + over21 + over31, !over20 + !over21 + over32, !over30 + !over31 + !over32};
}

/// Traverses the hierarchy. Visits the blocks of the seed triangles first. Then pops nodes and blocks from the stack,
/// and visits each one that may still contain the nearest triangle of a point. At the end, computes the exact distances
/// of the remaining candidates.
template <int Lanes, class Entry, class VisitNode, class VisitBlock, class InReach>
HWY_INLINE void traverse(Search<Lanes>& s, Stack<Entry>& stack, const VisitNode& visitNode,
                         const VisitBlock& visitBlock, const InReach& inReach) {
  for (int i = 0; i < s.seeds; ++i) visitBlock(s.seed[i]);
  for (std::uint32_t current = 0;;) {
    if (!(current & kBlockBit))
      visitNode(s.hierarchy.nodes()[current]);
    else if (!isSeed(s, current & ~kBlockBit))
      visitBlock(current & ~kBlockBit);
    while (true) {
      if (stack.empty()) return settle(s);
      const Entry& next = stack.pop();
      if (!inReach(next)) continue;
      current = next.child;
      break;
    }
  }
}

/// A node or block on the stack. `lower` is a lower bound of the squared distance from the query point to the box of
/// the node or block.
struct Pending {
  float lower;
  std::uint32_t child;
};

void runOne(Search<1>& s) {
  if (s.tooFar) return tryAll(s);
  const hn::CappedTag<float, kWidth> d;
  constexpr std::size_t kStep = hn::MaxLanes(d);
  const Block* blocks = s.hierarchy.blocks().data();
  const auto triangles = static_cast<std::uint32_t>(s.hierarchy.triangles().size());
  const Point<hn::Vec<decltype(d)>> point{hn::Set(d, s.point[0][0]), hn::Set(d, s.point[1][0]),
                                          hn::Set(d, s.point[2][0])};
  Stack<Pending> stack;
  HWY_ALIGN float lower[kWidth];
  const auto visitBlock = [&](std::uint32_t blockIndex) HWY_ATTR {
    const Block& block = blocks[blockIndex];
    HWY_ALIGN float limit[kWidth];
    for (std::size_t at = 0; at < kWidth; at += kStep) {
      const auto bounds = triangleDistance(d, point, [&](int f) HWY_ATTR { return hn::Load(d, block.field[f] + at); });
      hn::Store(bounds.lower, d, lower + at);
      hn::Store(limitFrom(d, bounds.upper, s.delta), d, limit + at);
    }
    if (s.count + kWidth > s.kCapacity) settle(s);
    const std::uint32_t first = blockIndex * kWidth, used = std::min<std::uint32_t>(kWidth, triangles - first);
    for (std::uint32_t i = 0; i < used; ++i) {
      if (!(lower[i] <= s.limit[0])) continue;
      s.limit[0] = std::min(s.limit[0], limit[i]);
      s.lower[s.count][0] = lower[i];
      s.candidates[s.count++] = first + i;
    }
  };
  const auto visitNode = [&](const Node& node) HWY_ATTR {
    for (std::size_t at = 0; at < kWidth; at += kStep)
      hn::Store(boxDistance(d, point, [&](int f) HWY_ATTR { return hn::Load(d, node.field[f] + at); }), d, lower + at);
    Pending* const room = stack.room();
    int hits = 0;
    for (float& key : lower) {
      hits += key <= s.limit[0];
      key = key <= s.limit[0] ? key : -1;
    }
    const std::array<int, kWidth> ranks = ranksOf(lower);
    for (int child = 0; child < kWidth; ++child) room[ranks[child]] = {lower[child], node.child[child]};
    stack.grow(hits);
  };
  traverse(s, stack, visitNode, visitBlock, [&](const Pending& next) HWY_ATTR { return next.lower <= s.limit[0]; });
}

template <int Lanes>
using PacketTag = hn::CappedTag<float, Lanes>;

/// A node or block on the stack. `lower` holds lower bounds of the squared distances from a packet's points to the box
/// of the node or block.
template <int Lanes>
struct PendingOfPacket {
  alignas(64) float lower[Lanes];
  std::uint32_t child;
};

/// Returns the least of the values `lower[i]` that are at most `limit[i]`, for all the vectors of a packet: lane j
/// holds the least of the lanes j of these vectors, or kOutOfReach.
template <int Lanes>
HWY_INLINE hn::Vec<PacketTag<Lanes>> leastInReach(const float* lower, const float* limit) {
  const PacketTag<Lanes> d;
  const auto none = hn::Set(d, kOutOfReach);
  auto least = none;
  for (std::size_t at = 0; at < Lanes; at += hn::MaxLanes(d)) {
    const auto bound = hn::Load(d, lower + at);
    least = hn::Min(least, hn::IfThenElse(bound <= hn::Load(d, limit + at), bound, none));
  }
  return least;
}

#if HWY_TARGET == HWY_SCALAR

/// Sets key[i] to the least lane of least[i].
template <class D>
HWY_INLINE void leastLanes(D, const hn::Vec<D>* least, float* key) {
  for (int i = 0; i < kWidth; ++i) key[i] = hn::GetLane(least[i]);
}

#else

/// Returns the least of all blocks of four lanes.
template <class D>
HWY_INLINE hn::Vec<hn::CappedTag<float, 4>> leastBlock(D d, hn::Vec<D> v) {
  if constexpr (hn::MaxLanes(d) == 4) {
    return v;
  } else {
    const hn::Half<D> half;
    return leastBlock(half, hn::Min(hn::LowerHalf(half, v), hn::UpperHalf(half, v)));
  }
}

/// Sets key[i] to the least lane of least[i]. The four vectors are interleaved, which takes half as many shuffles as
/// one vector after the other.
template <class D>
HWY_INLINE void leastLanes(D d, const hn::Vec<D>* least, float* key) {
  static_assert(kWidth == 4);
  const hn::RepartitionToWide<D> pairs;
  const auto leastOfTwo = [&](int i) HWY_ATTR {
    return hn::BitCast(
        pairs, hn::Min(hn::InterleaveLower(d, least[i], least[i + 1]), hn::InterleaveUpper(d, least[i], least[i + 1])));
  };
  const auto low = leastOfTwo(0), high = leastOfTwo(2);
  const auto all = hn::Min(hn::BitCast(d, hn::InterleaveLower(pairs, low, high)),
                           hn::BitCast(d, hn::InterleaveUpper(pairs, low, high)));
  hn::StoreU(leastBlock(d, all), hn::CappedTag<float, 4>(), key);
}

#endif

/// Pointers to the arrays of a hierarchy. As local copies they stay in registers during the search.
struct Arrays {
  explicit Arrays(const Hierarchy& hierarchy)
      : nodes(hierarchy.nodes().data()), blocks(hierarchy.blocks().data()), triangles(hierarchy.triangles()) {}

  const Node* nodes;
  const Block* blocks;
  std::span<const Triangle> triangles;
};

template <int Lanes>
HWY_INLINE Point<hn::Vec<PacketTag<Lanes>>> pointAt(const Search<Lanes>& s, std::size_t at) {
  const PacketTag<Lanes> d;
  return {hn::Load(d, s.point[0] + at), hn::Load(d, s.point[1] + at), hn::Load(d, s.point[2] + at)};
}

/// Adds to the candidates those triangles of a block that may be nearest to a point of the packet. The distances to
/// all triangles are computed before any triangle is rejected, because branches would be mispredicted.
template <int Lanes>
HWY_INLINE void visitBlockOfPacket(Search<Lanes>& s, const Arrays& arrays, std::uint32_t blockIndex) {
  const PacketTag<Lanes> d;
  const Block& block = arrays.blocks[blockIndex];
  HWY_ALIGN float lower[kWidth][Lanes];
  for (std::size_t at = 0; at < Lanes; at += hn::MaxLanes(d)) {
    const auto point = pointAt(s, at);
    auto upper = hn::Set(d, kOutOfReach);
    HWY_UNROLL(4)
    for (int i = 0; i < kWidth; ++i) {
      const auto bounds = triangleDistance(d, point, [&](int f) HWY_ATTR { return hn::Set(d, block.field[f][i]); });
      hn::Store(bounds.lower, d, lower[i] + at);
      upper = hn::Min(upper, bounds.upper);
    }
    hn::Store(hn::Min(hn::Load(d, s.limit + at), limitFrom(d, upper, s.delta)), d, s.limit + at);
  }
  if (s.count + kWidth > s.kCapacity) settle(s);
  const std::uint32_t first = blockIndex * kWidth;
  hwy::Prefetch(arrays.triangles.data() + first);
  for (std::uint32_t i = 0; i < kWidth; ++i) {
    std::copy_n(lower[i], Lanes, s.lower[s.count]);
    s.candidates[s.count] = first + i;
    s.count += anyInReach<Lanes>(lower[i], s.limit) & (first + i < arrays.triangles.size());
  }
}

/// Pushes onto the stack the children of a node that may contain the nearest triangle of a point of the packet.
template <int Lanes>
HWY_INLINE void visitNodeOfPacket(const Search<Lanes>& s, const Arrays& arrays, const Node& node,
                                  Stack<PendingOfPacket<Lanes>>& stack) {
  const PacketTag<Lanes> d;
  HWY_ALIGN float lower[kWidth][Lanes];
  for (std::size_t at = 0; at < Lanes; at += hn::MaxLanes(d)) {
    const auto point = pointAt(s, at);
    HWY_UNROLL(4)
    for (int child = 0; child < kWidth; ++child)
      hn::Store(boxDistance(d, point, [&](int f) HWY_ATTR { return hn::Set(d, node.field[f][child]); }), d,
                lower[child] + at);
  }
  hn::Vec<PacketTag<Lanes>> least[kWidth];
  HWY_UNROLL(4)
  for (int child = 0; child < kWidth; ++child) least[child] = leastInReach<Lanes>(lower[child], s.limit);
  float key[kWidth];
  leastLanes(d, least, key);
  HWY_UNROLL(4)
  for (float& bound : key) bound = bound < kOutOfReach ? bound : -1;
  PendingOfPacket<Lanes>* const room = stack.room();
  const std::array<int, kWidth> ranks = ranksOf(key);
  int hits = 0;
  HWY_UNROLL(4)
  for (int child = 0; child < kWidth; ++child) {
    PendingOfPacket<Lanes>& pending = room[ranks[child]];
    std::copy_n(lower[child], Lanes, pending.lower);
    pending.child = node.child[child];
    const bool hit = key[child] >= 0;
    hits += hit;
    prefetchChild(arrays.nodes, arrays.blocks, hit ? node.child[child] : 0);
  }
  stack.grow(hits);
}

template <int Lanes>
HWY_INLINE void runPacket(Search<Lanes>& s) {
  if (s.tooFar) return tryAll(s);
  const Arrays arrays(s.hierarchy);
  Stack<PendingOfPacket<Lanes>> stack;
  traverse(
      s, stack, [&](const Node& node) HWY_ATTR { visitNodeOfPacket(s, arrays, node, stack); },
      [&](std::uint32_t blockIndex) HWY_ATTR { visitBlockOfPacket(s, arrays, blockIndex); },
      [&](const PendingOfPacket<Lanes>& next) HWY_ATTR { return anyInReach<Lanes>(next.lower, s.limit); });
}

void runSmallPacket(Search<kSmallPacket>& s) { runPacket(s); }
void runLargePacket(Search<kPacket>& s) { runPacket(s); }

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace hpsdf::bvh
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hpsdf::bvh {

HWY_EXPORT(runOne);
HWY_EXPORT(runSmallPacket);
HWY_EXPORT(runLargePacket);

Nearest nearestTriangle(const Hierarchy& hierarchy, const Vector3& x) {
  Search<1> search(hierarchy, {&x, 1});
  run(search);
  return search.result(0);
}

double distanceTo(const Hierarchy& hierarchy, const Vector3& x) {
  return std::sqrt(squaredDistance(hierarchy.frame(nearestTriangle(hierarchy, x).slot), x));
}

namespace {

template <int Lanes>
void findNearest(const Hierarchy& hierarchy, std::span<const Vector3> points, std::span<Nearest> nearest,
                 std::span<const double> within) {
  Search<Lanes> search(hierarchy, points);
  if (!within.empty()) search.restrictTo(within);
  for (const Nearest& start : nearest)
    if (start.slot != Nearest::kNone) search.addSeed(start.slot);
  run(search);
  for (std::size_t lane = 0; lane < points.size(); ++lane) nearest[lane] = search.result(int(lane));
}

}  // namespace

void nearestTriangles(const Hierarchy& hierarchy, std::span<const Vector3> points, std::span<Nearest> nearest,
                      std::span<const double> within) {
  assert(points.size() == nearest.size() && !points.empty() && points.size() <= kPacket);
  if (points.size() <= kSmallPacket)
    findNearest<kSmallPacket>(hierarchy, points, nearest, within);
  else
    findNearest<kPacket>(hierarchy, points, nearest, within);
}

std::string_view instructionSet() {
  // In Highway's bit masks, lower bits stand for better instruction sets: the lowest bit that is set is the best one.
  return hwy::TargetName(static_cast<std::int64_t>(
      std::uint64_t{1} << std::countr_zero(static_cast<std::uint64_t>(hwy::SupportedTargets() & HWY_TARGETS))));
}

void run(Search<1>& search) { HWY_DYNAMIC_DISPATCH(runOne)(search); }
void run(Search<kSmallPacket>& search) { HWY_DYNAMIC_DISPATCH(runSmallPacket)(search); }
void run(Search<kPacket>& search) { HWY_DYNAMIC_DISPATCH(runLargePacket)(search); }

template <int Lanes>
Search<Lanes>::Search(const Hierarchy& tree, std::span<const Vector3> points) : hierarchy(tree) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double largest = 1;
  for (int lane = 0; lane < Lanes; ++lane) {
    const Vector3& x = points[std::min(std::size_t(lane), points.size() - 1)];
    const Vector3 local = hierarchy.local(x);
    for (int axis = 0; axis < 3; ++axis) {
      exact[axis][lane] = x[axis];
      point[axis][lane] = static_cast<float>(local[axis]);
      tooFar |= !(std::abs(local[axis]) < 1e15);  // This is also true for NaN, which std::max below ignores.
      largest = std::max(largest, std::abs(local[axis]));
    }
    limit[lane] = kOutOfReach;
    squared[lane] = kInfinity;
    triangle[lane] = kInfinity;
  }
  delta = 32 * std::numeric_limits<float>::epsilon() * static_cast<float>(largest);
}

template <int Lanes>
void Search<Lanes>::restrictTo(std::span<const double> within) {
  isRestricted = true;
  for (int lane = 0; lane < Lanes; ++lane) {
    const double bound = within[std::min(std::size_t(lane), within.size() - 1)];
    const double distance = std::sqrt(bound) * hierarchy.scale() + double(delta);
    limit[lane] = static_cast<float>(std::min(distance * distance * 1.000001, double(kOutOfReach)));
  }
}

template <int Lanes>
void Search<Lanes>::addSeed(std::uint32_t triangleSlot) {
  const std::uint32_t block = triangleSlot / kWidth;
  if (std::find(seed.begin(), seed.begin() + seeds, block) == seed.begin() + seeds) seed[seeds++] = block;
}

template <int Lanes>
Nearest Search<Lanes>::result(int lane) const {
  if (!(triangle[lane] < std::numeric_limits<double>::infinity())) {
    if (isRestricted)
      return {.slot = Nearest::kNone,
              .squared = std::numeric_limits<double>::infinity(),
              .point = {},
              .normal = Vector3::Zero(),
              .length = 0,
              .firstCorner = 0};
    // The query point is not finite.
    const TriangleFrame frame = hierarchy.frame(0);
    return {.slot = 0,
            .squared = std::numeric_limits<double>::quiet_NaN(),
            .point = locate(frame, Vector3(exact[0][lane], exact[1][lane], exact[2][lane])),
            .normal = frame.normal,
            .length = frame.length,
            .firstCorner = frame.firstCorner};
  }
  return {.slot = static_cast<std::uint32_t>(slot[lane]),
          .squared = squared[lane],
          .point = {height[lane], {side[0][lane], side[1][lane], side[2][lane]}, inside[lane] != 0},
          .normal = {normal[0][lane], normal[1][lane], normal[2][lane]},
          .length = length[lane],
          .firstCorner = static_cast<std::uint32_t>(firstCorner[lane])};
}

template struct Search<1>;
template struct Search<kSmallPacket>;
template struct Search<kPacket>;

}  // namespace hpsdf::bvh
#endif
