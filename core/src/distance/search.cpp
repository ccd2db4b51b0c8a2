#include "distance/search.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "distance/search.cpp"
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hpsdf::distance {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// A level leaves at most three children waiting; see kMaxLevel in hierarchy.cpp.
constexpr std::size_t kStackSize = 3 * 64 + 4;

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
  const auto dot = [&](int f) HWY_ATTR {
    return hn::MulAdd(wz, field(f + 2), hn::MulAdd(wy, field(f + 1), wx * field(f)));
  };
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

struct Waiting {
  float key;
  std::uint32_t child;
};

void walkOne(Search<1>& s) {
  const hn::CappedTag<float, kWidth> d;
  constexpr std::size_t kStep = hn::MaxLanes(d);
  const Node* nodes = s.hierarchy.nodes().data();
  const Block* blocks = s.hierarchy.blocks().data();
  const Point<hn::Vec<decltype(d)>> point{hn::Set(d, s.point[0][0]), hn::Set(d, s.point[1][0]),
                                          hn::Set(d, s.point[2][0])};
  std::array<Waiting, kStackSize> stack;
  std::size_t top = 0;
  std::uint32_t current = 0;
  while (true) {
    HWY_ALIGN float lower[kWidth];
    if (current & kBlockBit) {
      const Block& block = blocks[current & ~kBlockBit];
      HWY_ALIGN float limit[kWidth];
      for (std::size_t at = 0; at < kWidth; at += kStep) {
        const auto bounds =
            triangleDistance(d, point, [&](int f) HWY_ATTR { return hn::Load(d, block.field[f] + at); });
        hn::Store(bounds.lower, d, lower + at);
        hn::Store(limitFrom(d, bounds.upper, s.delta), d, limit + at);
      }
      if (s.count + kWidth > s.kCapacity) s.settle();
      for (std::uint32_t i = 0; i < block.count; ++i) {
        if (!(lower[i] <= s.limit[0])) continue;
        s.limit[0] = std::min(s.limit[0], limit[i]);
        s.lower[s.count][0] = lower[i];
        s.candidates[s.count++] = block.firstSlot + i;
      }
    } else {
      const Node& node = nodes[current];
      for (std::size_t at = 0; at < kWidth; at += kStep)
        hn::Store(boxDistance(d, point, [&](int f) HWY_ATTR { return hn::Load(d, node.field[f] + at); }), d,
                  lower + at);
      // farthest first onto the stack, so that the nearest comes off next
      const std::size_t bottom = top;
      for (int lane = 0; lane < kWidth; ++lane) {
        if (!(lower[lane] <= s.limit[0]) || node.child[lane] == kEmpty) continue;
        std::size_t place = top++;
        for (; place > bottom && stack[place - 1].key < lower[lane]; --place) stack[place] = stack[place - 1];
        stack[place] = {lower[lane], node.child[lane]};
      }
    }
    do {
      if (top == 0) return;
      --top;
    } while (!(stack[top].key <= s.limit[0]));
    current = stack[top].child;
  }
}

using PacketTag = hn::CappedTag<float, kPacket>;
constexpr std::size_t kLanes = hn::MaxLanes(PacketTag());
constexpr std::size_t kParts = kPacket / kLanes;

struct PacketWaiting {
  alignas(32) float lower[kPacket];
  float key;
  std::uint32_t child;
};

void walkPacket(Search<kPacket>& s) {
  const PacketTag d;
  using V = hn::Vec<PacketTag>;
  const Node* nodes = s.hierarchy.nodes().data();
  const Block* blocks = s.hierarchy.blocks().data();
  std::array<PacketWaiting, kStackSize> stack;
  std::size_t top = 0;
  std::uint32_t current = 0;
  const auto pointOf = [&](std::size_t part) HWY_ATTR {
    return Point<V>{hn::Load(d, s.point[0] + part * kLanes), hn::Load(d, s.point[1] + part * kLanes),
                    hn::Load(d, s.point[2] + part * kLanes)};
  };
  const auto inReach = [&](const float* lower) HWY_ATTR {
    for (std::size_t part = 0; part < kParts; ++part) {
      const std::size_t at = part * kLanes;
      if (!hn::AllFalse(d, hn::Load(d, lower + at) <= hn::Load(d, s.limit + at))) return true;
    }
    return false;
  };
  while (true) {
    if (current & kBlockBit) {
      const Block& block = blocks[current & ~kBlockBit];
      for (std::uint32_t i = 0; i < block.count; ++i) {
        if (s.count == s.kCapacity) s.settle();
        bool any = false;
        for (std::size_t part = 0; part < kParts; ++part) {
          const std::size_t at = part * kLanes;
          const auto bounds = triangleDistance(d, pointOf(part),
                                               [&](int f) HWY_ATTR { return hn::Set(d, block.field[f][i]); });
          const auto limit = hn::Load(d, s.limit + at);
          hn::Store(bounds.lower, d, s.lower[s.count] + at);
          if (hn::AllFalse(d, bounds.lower <= limit)) continue;
          any = true;
          hn::Store(hn::Min(limit, limitFrom(d, bounds.upper, s.delta)), d, s.limit + at);
        }
        if (any) s.candidates[s.count++] = block.firstSlot + i;
      }
    } else {
      const Node& node = nodes[current];
      const std::size_t bottom = top;
      for (int child = 0; child < kWidth; ++child) {
        if (node.child[child] == kEmpty) break;
        PacketWaiting waiting;
        auto least = hn::Set(d, 3e38f);
        bool any = false;
        for (std::size_t part = 0; part < kParts; ++part) {
          const std::size_t at = part * kLanes;
          const auto lower =
              boxDistance(d, pointOf(part), [&](int f) HWY_ATTR { return hn::Set(d, node.field[f][child]); });
          hn::Store(lower, d, waiting.lower + at);
          any |= !hn::AllFalse(d, lower <= hn::Load(d, s.limit + at));
          least = hn::Min(least, lower);
        }
        if (!any) continue;
        waiting.key = hn::GetLane(hn::MinOfLanes(d, least));
        waiting.child = node.child[child];
        std::size_t place = top++;
        for (; place > bottom && stack[place - 1].key < waiting.key; --place) stack[place] = stack[place - 1];
        stack[place] = waiting;
      }
    }
    do {
      if (top == 0) return;
      --top;
    } while (!inReach(stack[top].lower));
    current = stack[top].child;
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace hpsdf::distance
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hpsdf::distance {

HWY_EXPORT(walkOne);
HWY_EXPORT(walkPacket);

void walk(Search<1>& search) {
  HWY_DYNAMIC_DISPATCH(walkOne)(search);
  search.settle();
}

void walk(Search<kPacket>& search) {
  HWY_DYNAMIC_DISPATCH(walkPacket)(search);
  search.settle();
}

template <int Lanes>
void Search<Lanes>::settle() {
  for (int c = 0; c < count; ++c) {
    const std::uint32_t slot = candidates[c];
    const TriangleFrame& frame = hierarchy.triangles()[slot];
    for (int lane = 0; lane < Lanes; ++lane) {
      if (!(lower[c][lane] <= limit[lane]) || best[lane].slot == slot) continue;
      const double squared = squaredDistance(frame, exactPoint[lane]);
      Nearest& nearest = best[lane];
      if (!(squared <= nearest.squaredDistance)) continue;
      if (squared == nearest.squaredDistance && frame.triangle >= nearest.triangle) continue;
      nearest = {slot, squared, frame.triangle};
    }
  }
  count = 0;
}

template struct Search<1>;
template struct Search<kPacket>;

}  // namespace hpsdf::distance
#endif
