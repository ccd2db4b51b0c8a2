#include "bvh/search.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bvh/search.cpp"
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hpsdf::distance {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// A level leaves at most three children waiting (see kMaxLevel in triangle_tree.cpp); four more are written at its
/// end.
constexpr std::size_t kStackSize = 3 * 64 + 8;

template <class V>
struct Point {
  V x, y, z;
};

template <class D>
struct SquaredBounds {
  hn::Vec<D> lower, upper;
};

/// Square of the distance to an oriented box. `field(i)` is the box's i-th number.
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

/// Bounds of the squared distance to a triangle, but for the rounding of the point and of the triangle's numbers.
/// `field(i)` is the triangle's i-th number.
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
  // Rounding may put a point beyond a sharp corner inside both its sides: within the base as well, it is inside up to
  // rounding.
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

/// (√upper + δ)²: what a lower bound must not exceed to be nearer than a triangle with that upper bound.
template <class D>
HWY_INLINE hn::Vec<D> limitFrom(D d, hn::Vec<D> upper, float delta) {
  const auto distance = hn::Sqrt(upper) + hn::Set(d, delta);
  return distance * distance * hn::Set(d, 1.000001f);
}

/// A point in a triangle's frame, as `locate` of triangle_frame.h has it: the same operations in the same order, none
/// of them fused, so that the results are the same to the bit on every instruction set.
template <class D>
struct Located {
  hn::Vec<D> squared, height, side[3], inside;
};

template <class D>
HWY_INLINE Located<D> locateLanes(D d, const TriangleFrame& f, const Point<hn::Vec<D>>& point) {
  const auto number = [&](double value) HWY_ATTR { return hn::Set(d, value); };
  const auto zero = hn::Zero(d), one = number(1.0);
  const auto unit = [&](auto t) HWY_ATTR { return hn::Min(hn::Max(t, zero), one); };
  const auto wx = point.x - number(f.origin[0]), wy = point.y - number(f.origin[1]), wz = point.z - number(f.origin[2]);
  const auto dot = [&](const Vector3& v) HWY_ATTR { return wx * number(v[0]) + wy * number(v[1]) + wz * number(v[2]); };
  const auto p = dot(f.along), q = dot(f.across), height = dot(f.normal);
  const auto length = number(f.length), apexAlong = number(f.apexAlong), apexAcross = number(f.apexAcross);

  const auto base = p - hn::Min(hn::Max(p, zero), length);
  const auto left = unit((p * apexAlong + q * apexAcross) * number(f.inverseSquaredLeft));
  const auto leftP = p - left * apexAlong, leftQ = q - left * apexAcross;
  const auto fromB = p - length, rightAlong = apexAlong - length;
  const auto right = unit((fromB * rightAlong + q * apexAcross) * number(f.inverseSquaredRight));
  const auto rightP = fromB - right * rightAlong, rightQ = q - right * apexAcross;
  const auto inside = hn::And(q > zero, hn::And(p * apexAcross > q * apexAlong, q * rightAlong > fromB * apexAcross));
  Located<D> at{zero,
                height,
                {base * base + q * q, rightP * rightP + rightQ * rightQ, leftP * leftP + leftQ * leftQ},
                hn::IfThenElseZero(inside, one)};
  at.squared = height * height + hn::IfThenZeroElse(inside, hn::Min(hn::Min(at.side[0], at.side[1]), at.side[2]));
  return at;
}

/// Whether a lower bound is within its limit for any of the points.
template <int Lanes>
HWY_INLINE bool anyInReach(const float* lower, const float* limit) {
  const hn::CappedTag<float, Lanes> d;
  constexpr std::size_t kStep = hn::MaxLanes(d);
  auto within = hn::Load(d, lower) <= hn::Load(d, limit);
  for (std::size_t at = kStep; at < Lanes; at += kStep)
    within = hn::Or(within, hn::Load(d, lower + at) <= hn::Load(d, limit + at));
  return !hn::AllFalse(d, within);
}

/// Computes the distances to the candidates in double, keeps what is nearer, and empties the list.
template <int Lanes>
HWY_INLINE void settle(Search<Lanes>& s) {
  const hn::CappedTag<double, Lanes> d;
  constexpr std::size_t kStep = hn::MaxLanes(d);
  for (int c = 0; c < s.count; ++c) {
    if (!anyInReach<Lanes>(s.lower[c], s.limit)) continue;
    const TriangleFrame& frame = s.hierarchy.frameAt(s.candidates[c]);
    const auto triangle = hn::Set(d, static_cast<double>(frame.triangle));
    const auto placed = hn::Set(d, static_cast<double>(s.candidates[c]));
    for (std::size_t at = 0; at < Lanes; at += kStep) {
      const auto found =
          locateLanes(d, frame,
                      Point<hn::Vec<decltype(d)>>{hn::Load(d, s.exact[0] + at), hn::Load(d, s.exact[1] + at),
                                                  hn::Load(d, s.exact[2] + at)});
      const auto best = hn::Load(d, s.squared + at);
      const auto better =
          hn::Or(found.squared < best, hn::And(found.squared == best, triangle < hn::Load(d, s.triangle + at)));
      if (hn::AllFalse(d, better)) continue;
      const auto keep = [&](double* kept, auto value) HWY_ATTR {
        hn::Store(hn::IfThenElse(better, value, hn::Load(d, kept + at)), d, kept + at);
      };
      keep(s.squared, found.squared);
      keep(s.triangle, triangle);
      keep(s.place, placed);
      keep(s.height, found.height);
      for (int side = 0; side < 3; ++side) keep(s.side[side], found.side[side]);
      keep(s.inside, found.inside);
    }
  }
  s.count = 0;
}

/// For points too far for float: every triangle is a candidate.
template <int Lanes>
void tryAll(Search<Lanes>& s) {
  const auto& blocks = s.hierarchy.blocks();
  for (std::uint32_t b = 0; b < blocks.size(); ++b) {
    if (s.count + kWidth > s.kCapacity) settle(s);
    for (std::uint32_t i = 0; i < blocks[b].count; ++i) {
      std::fill_n(s.lower[s.count], Lanes, 0.0f);
      s.candidates[s.count++] = b * kWidth + i;
    }
  }
  settle(s);
}

template <int Lanes>
HWY_INLINE bool isSeed(const Search<Lanes>& s, std::uint32_t block) {
  for (int i = 0; i < s.seeds; ++i)
    if (s.seed[i] == block) return true;
  return false;
}

/// Brings what is needed next into the cache while other work goes on.
template <class T>
HWY_INLINE void fetch(const T* what) {
  for (std::size_t line = 0; line < sizeof(T); line += 64) hwy::Prefetch(reinterpret_cast<const char*>(what) + line);
}

HWY_INLINE void fetchChild(const Node* nodes, const Block* blocks, std::uint32_t child) {
  static_assert(sizeof(Node) == sizeof(Block));
  fetch(child & kBlockBit ? reinterpret_cast<const Node*>(blocks + (child & ~kBlockBit)) : nodes + child);
}

/// Children that wait for their visit, those of one node farthest first, so that the nearest comes off next.
template <class Entry>
class Stack {
 public:
  bool empty() const { return top_ == 0; }
  const Entry& pop() { return entries_[--top_]; }

  /// Room for four entries more, of which `grow` lets the first `count` stay.
  Entry* room() { return entries_.data() + top_; }
  void grow(int count) { top_ += count; }

 private:
  std::array<Entry, kStackSize> entries_;
  std::size_t top_ = 0;
};

/// Where four children go in a stack's room: by descending key, and behind those in reach what is not (key < 0).
/// Comparing all with all takes no branch, of which most would be mispredicted.
HWY_INLINE std::array<int, kWidth> placesOf(const float* key) {
  static_assert(kWidth == 4);
  const bool over10 = key[1] > key[0], over20 = key[2] > key[0], over30 = key[3] > key[0], over21 = key[2] > key[1],
             over31 = key[3] > key[1], over32 = key[3] > key[2];
  return {over10 + over20 + over30, !over10 + over21 + over31, !over20 + !over21 + over32, !over30 + !over31 + !over32};
}

/// Visits the seeds and then what is within reach when its turn comes; settles the search.
template <int Lanes, class Entry, class VisitNode, class VisitBlock, class InReach>
HWY_INLINE void walk(Search<Lanes>& s, Stack<Entry>& stack, const VisitNode& visitNode, const VisitBlock& visitBlock,
                     const InReach& inReach) {
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

struct Waiting {
  float lower;
  std::uint32_t child;
};

void runOne(Search<1>& s) {
  if (s.tooFar) return tryAll(s);
  const hn::CappedTag<float, kWidth> d;
  constexpr std::size_t kStep = hn::MaxLanes(d);
  const Block* blocks = s.hierarchy.blocks().data();
  const Point<hn::Vec<decltype(d)>> point{hn::Set(d, s.point[0][0]), hn::Set(d, s.point[1][0]),
                                          hn::Set(d, s.point[2][0])};
  Stack<Waiting> stack;
  HWY_ALIGN float lower[kWidth];
  const auto visitBlock = [&](std::uint32_t place) HWY_ATTR {
    const Block& block = blocks[place];
    HWY_ALIGN float limit[kWidth];
    for (std::size_t at = 0; at < kWidth; at += kStep) {
      const auto bounds = triangleDistance(d, point, [&](int f) HWY_ATTR { return hn::Load(d, block.field[f] + at); });
      hn::Store(bounds.lower, d, lower + at);
      hn::Store(limitFrom(d, bounds.upper, s.delta), d, limit + at);
    }
    if (s.count + kWidth > s.kCapacity) settle(s);
    for (std::uint32_t i = 0; i < block.count; ++i) {
      if (!(lower[i] <= s.limit[0])) continue;
      s.limit[0] = std::min(s.limit[0], limit[i]);
      s.lower[s.count][0] = lower[i];
      s.candidates[s.count++] = place * kWidth + i;
    }
  };
  const auto visitNode = [&](const Node& node) HWY_ATTR {
    for (std::size_t at = 0; at < kWidth; at += kStep)
      hn::Store(boxDistance(d, point, [&](int f) HWY_ATTR { return hn::Load(d, node.field[f] + at); }), d, lower + at);
    Waiting* const room = stack.room();
    int hits = 0;
    for (float& key : lower) {
      hits += key <= s.limit[0];
      key = key <= s.limit[0] ? key : -1;
    }
    const std::array<int, kWidth> places = placesOf(lower);
    for (int child = 0; child < kWidth; ++child) room[places[child]] = {lower[child], node.child[child]};
    stack.grow(hits);
  };
  walk(s, stack, visitNode, visitBlock, [&](const Waiting& next) HWY_ATTR { return next.lower <= s.limit[0]; });
}

using PacketTag = hn::CappedTag<float, kPacket>;
constexpr std::size_t kLanes = hn::MaxLanes(PacketTag());

struct PacketWaiting {
  alignas(32) float lower[kPacket];
  std::uint32_t child;
};

/// The least of the lower bounds that are within their limit; -1 if none is.
HWY_INLINE float leastInReach(PacketTag d, const float* lower, const float* limit) {
  const auto none = hn::Set(d, kOutOfReach);
  auto all = none;
  for (std::size_t at = 0; at < kPacket; at += kLanes) {
    const auto bound = hn::Load(d, lower + at);
    all = hn::Min(all, hn::IfThenElse(bound <= hn::Load(d, limit + at), bound, none));
  }
  all = hn::MinOfLanes(d, all);
  return hn::GetLane(hn::IfThenElse(all < none, all, hn::Set(d, -1.0f)));
}

void runPacket(Search<kPacket>& s) {
  if (s.tooFar) return tryAll(s);
  const PacketTag d;
  using V = hn::Vec<PacketTag>;
  const Node* nodes = s.hierarchy.nodes().data();
  const Block* blocks = s.hierarchy.blocks().data();
  const TriangleFrame* frames = s.hierarchy.frames().data();
  Stack<PacketWaiting> stack;
  const auto pointAt = [&](std::size_t at) HWY_ATTR {
    return Point<V>{hn::Load(d, s.point[0] + at), hn::Load(d, s.point[1] + at), hn::Load(d, s.point[2] + at)};
  };
  // All is computed first, and without branches: what comes out is hard to predict.
  const auto visitBlock = [&](std::uint32_t place) HWY_ATTR {
    const Block& block = blocks[place];
    HWY_ALIGN float lower[kWidth][kPacket];
    for (std::size_t at = 0; at < kPacket; at += kLanes) {
      const Point<V> point = pointAt(at);
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
    for (std::uint32_t i = 0; i < kWidth; ++i) {
      std::copy_n(lower[i], kPacket, s.lower[s.count]);
      s.candidates[s.count] = place * kWidth + i;
      const bool kept = anyInReach<kPacket>(lower[i], s.limit) & (i < block.count);
      s.count += kept;
      fetch(frames + block.first + (kept ? i : 0));
    }
  };
  const auto visitNode = [&](const Node& node) HWY_ATTR {
    HWY_ALIGN float lower[kWidth][kPacket];
    for (std::size_t at = 0; at < kPacket; at += kLanes) {
      const Point<V> point = pointAt(at);
      HWY_UNROLL(4)
      for (int child = 0; child < kWidth; ++child)
        hn::Store(boxDistance(d, point, [&](int f) HWY_ATTR { return hn::Set(d, node.field[f][child]); }), d,
                  lower[child] + at);
    }
    float key[kWidth];
    HWY_UNROLL(4)
    for (int child = 0; child < kWidth; ++child) key[child] = leastInReach(d, lower[child], s.limit);
    PacketWaiting* const room = stack.room();
    const std::array<int, kWidth> places = placesOf(key);
    int hits = 0;
    HWY_UNROLL(4)
    for (int child = 0; child < kWidth; ++child) {
      PacketWaiting& waiting = room[places[child]];
      std::copy_n(lower[child], kPacket, waiting.lower);
      waiting.child = node.child[child];
      const bool hit = key[child] >= 0;
      hits += hit;
      fetchChild(nodes, blocks, hit ? node.child[child] : 0);
    }
    stack.grow(hits);
  };
  walk(s, stack, visitNode, visitBlock,
       [&](const PacketWaiting& next) HWY_ATTR { return anyInReach<kPacket>(next.lower, s.limit); });
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace hpsdf::distance
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hpsdf::distance {

HWY_EXPORT(runOne);
HWY_EXPORT(runPacket);

Nearest nearestTriangle(const Hierarchy& hierarchy, const Vector3& x) {
  Search<1> search(hierarchy, {x});
  run(search);
  return search.result(0);
}

void nearestTriangles(const Hierarchy& hierarchy, const std::array<Vector3, kPacket>& points,
                      std::array<Nearest, kPacket>& nearest) {
  Search<kPacket> search(hierarchy, points);
  for (const Nearest& start : nearest) search.addSeed(start.place);
  run(search);
  for (int lane = 0; lane < kPacket; ++lane) nearest[lane] = search.result(lane);
}

std::string_view instructionSet() {
  // lower bits are better sets
  return hwy::TargetName(static_cast<std::int64_t>(
      std::uint64_t{1} << std::countr_zero(static_cast<std::uint64_t>(hwy::SupportedTargets() & HWY_TARGETS))));
}

void run(Search<1>& search) { HWY_DYNAMIC_DISPATCH(runOne)(search); }
void run(Search<kPacket>& search) { HWY_DYNAMIC_DISPATCH(runPacket)(search); }

template <int Lanes>
Search<Lanes>::Search(const Hierarchy& tree, const std::array<Vector3, Lanes>& points) : hierarchy(tree) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double reach = 1;
  for (int lane = 0; lane < Lanes; ++lane) {
    const Vector3 local = hierarchy.local(points[lane]);
    for (int axis = 0; axis < 3; ++axis) {
      exact[axis][lane] = points[lane][axis];
      point[axis][lane] = static_cast<float>(local[axis]);
      tooFar |= !(std::abs(local[axis]) < 1e15);  // also for NaN, which `reach` passes over
      reach = std::max(reach, std::abs(local[axis]));
    }
    limit[lane] = kOutOfReach;
    squared[lane] = kInfinity;
    triangle[lane] = kInfinity;
  }
  delta = 32 * std::numeric_limits<float>::epsilon() * static_cast<float>(reach);
}

template <int Lanes>
void Search<Lanes>::addSeed(std::uint32_t near) {
  const std::uint32_t block = near / kWidth;
  if (std::find(seed.begin(), seed.begin() + seeds, block) == seed.begin() + seeds) seed[seeds++] = block;
}

template <int Lanes>
Nearest Search<Lanes>::result(int lane) const {
  if (!(triangle[lane] < std::numeric_limits<double>::infinity())) {  // a point that is not finite
    const TriangleFrame& frame = hierarchy.frameAt(0);
    return {0, locate(frame, Vector3(exact[0][lane], exact[1][lane], exact[2][lane]))};
  }
  return {static_cast<std::uint32_t>(place[lane]),
          {height[lane], {side[0][lane], side[1][lane], side[2][lane]}, inside[lane] != 0}};
}

template struct Search<1>;
template struct Search<kPacket>;

}  // namespace hpsdf::distance
#endif
