#pragma once
// Blended fields: a partition of unity over leaves that reach a little beyond their faces (docs/design.md).

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <variant>

#include "field/query/evaluate.h"
#include "hpsdf/detail/field_data.h"
#include "hpsdf/detail/lookup_grid.h"

namespace hpsdf {

/// The axes along which a point of a leaf is so close to a face that others may reach it: bit 0 for x. Of a field
/// without blending none.
inline unsigned nearAxes(const FieldData& field, const std::array<double, 3>& local) {
  if (!(field.blend > 0)) return 0;
  const double core = 1 - 2 * field.blend;
  const auto bit = [&](int axis) { return unsigned(std::abs(local[axis]) > core) << axis; };
  return bit(0) | bit(1) | bit(2);
}

/// Of a leaf's say across its sides along one axis, in world units.
struct Ramp {
  double value, slope;
};

/// S(t) = 1/2 + 3t/4 − t³/4 of the distance to the nearer side over the reach there, from 0 at −1 to 1 at 1: the
/// gentlest step of which the slope is continuous. A point is within reach of one of the two sides at most.
inline Ramp rampAlong(const GridFrame& frame, const FoundLeaf& leaf, int axis, std::uint32_t reach, double blend) {
  const bool upper = leaf.local[axis] > 0;
  const int depth = blend_extent::depth(reach, axis, upper);
  if (depth == blend_extent::kWall) return {1, 0};
  // 2^(depth - leaf.depth) / blend, from local coordinates to parts of an edge
  const double scale = std::bit_cast<double>(std::uint64_t(1022 + depth - leaf.depth) << 52) / blend;
  const double t = std::clamp((1 - std::abs(leaf.local[axis])) * scale, -1.0, 1.0);
  const double toWorld = 2.0 * (std::uint32_t{1} << leaf.depth) * frame.cells[axis] / frame.size[axis];
  return {0.5 + t * (0.75 - 0.25 * t * t), (upper ? -0.75 : 0.75) * (1 - t * t) * scale * toWorld};
}

// Most points near a face are near one alone, and two leaves reach them: their own and the one across.

/// Just across the near face of a leaf, as `GridPoint::fixed`: beyond the domain's last or below 0 where it ends.
inline std::int64_t fixedAcross(std::int64_t place, int depth, bool upper) {
  return upper ? (place + 1) << (kMaxDepth - depth) : (place << (kMaxDepth - depth)) - 1;
}

/// Whether no third leaf reaches the point, which is near the first leaf's face across `axis` alone: then it is away
/// from the other faces of the leaf across too.
inline bool noThird(const FieldData& field, const std::array<double, 3>& localAcross, int axis) {
  return (nearAxes(field, localAcross) & ~(1U << axis)) == 0;
}

/// The mean of what the two say, weighted by their ramps along `axis`.
inline double between(double one, const Ramp& ofOne, double other, const Ramp& ofOther, int) {
  return one + ofOther.value / (ofOne.value + ofOther.value) * (other - one);
}
inline ValueAndGradient between(const ValueAndGradient& one, const Ramp& ofOne, const ValueAndGradient& other,
                                const Ramp& ofOther, int axis) {
  const double sum = ofOne.value + ofOther.value, share = ofOther.value / sum, difference = other.value - one.value;
  ValueAndGradient result{one.value + share * difference, one.gradient + share * (other.gradient - one.gradient)};
  result.gradient[axis] += difference * (ofOther.slope * ofOne.value - ofOther.value * ofOne.slope) / (sum * sum);
  return result;
}

// All others.

/// The cells of one depth that come within `blend` of their edges of a point: one or two along each axis.
struct Candidates {
  std::array<std::int64_t, 3> first;
  std::array<int, 3> more;  ///< 1 where there are two

  Candidates(const GridFrame& frame, const std::array<double, 3>& coordinates, int depth, double blend) {
    const double scale = std::uint32_t{1} << depth;
    for (int axis = 0; axis < 3; ++axis) {
      const double at = coordinates[axis] * scale;
      const std::int64_t last = frame.last[axis] >> (kMaxDepth - depth);
      // of what is below 0 the cast makes 0; at the domain's end a tiny width is lost in rounding
      first[axis] = std::min(static_cast<std::int64_t>(at - blend), last);
      more[axis] = std::min(static_cast<std::int64_t>(at + blend), last) > first[axis];
    }
  }

  /// f(number among the eight that there could be, place)
  template <typename F>
  void forEach(F&& f) const {
    for (int z = 0; z <= more[2]; ++z)
      for (int y = 0; y <= more[1]; ++y)
        for (int x = 0; x <= more[0]; ++x)
          f(x + 2 * y + 4 * z, std::array<std::int64_t, 3>{first[0] + x, first[1] + y, first[2] + z});
  }
};

/// Calls visit(leaf) for every leaf that may reach a point of the domain, each once. Level by level: a child comes no
/// closer to a point than its parent does, measured in their own edges, so that at each depth there are eight nodes at
/// most to go on from. `ownDepth` is that of the point's own leaf: where that is larger than the lookup grid's entries,
/// others of its size reach farther than an entry's edge tells, and the way starts at the base cells.
template <typename Visit>
void visitReaching(const FieldData& field, const LookupGrid& lookupGrid, const std::array<double, 3>& coordinates,
                   int ownDepth, Visit&& visit) {
  const bool byLookupGrid = ownDepth >= lookupGrid.depth;
  int depth = byLookupGrid ? lookupGrid.depth : 0;
  Candidates cells(lookupGrid.frame, coordinates, depth, field.blend);
  std::array<std::uint64_t, 8> open;  // internal nodes' bits by their number among the candidates; 0: none
  bool any = false;
  cells.forEach([&](int number, const std::array<std::int64_t, 3>& place) {
    const std::int64_t entry = byLookupGrid ? place[2] * lookupGrid.slab + place[1] * lookupGrid.row + place[0]
                                            : (place[2] * field.grid[1] + place[1]) * field.grid[0] + place[0];
    const std::uint64_t bits = byLookupGrid ? lookupGrid.entries[entry] : field.nodes[entry];
    open[number] = node::isLeaf(bits) ? 0 : bits;
    any |= open[number] != 0;
    if (open[number] != 0) return;
    const int above = byLookupGrid ? depth - LookupGrid::depthOf(bits) : 0;
    std::array<std::int64_t, 3> ofLeaf;
    for (int axis = 0; axis < 3; ++axis) {
      ofLeaf[axis] = place[axis] >> above;
      // a leaf that covers several entries is that of the first
      if (place[axis] > cells.first[axis] && ofLeaf[axis] << above != place[axis]) return;
    }
    visit(leafWithin(bits, depth - above, (byLookupGrid ? field.nodes.size() : 0) + entry, ofLeaf, coordinates));
  });
  while (any) {
    ++depth;
    const Candidates children(lookupGrid.frame, coordinates, depth, field.blend);
    std::array<std::uint64_t, 8> next;
    any = false;
    children.forEach([&](int number, const std::array<std::int64_t, 3>& place) {
      next[number] = 0;
      int parent = 0;
      std::uint32_t child = 0;
      for (int axis = 0; axis < 3; ++axis) {
        parent += static_cast<int>((place[axis] >> 1) - cells.first[axis]) << axis;
        child += static_cast<std::uint32_t>(place[axis] & 1) << axis;
      }
      if (open[parent] == 0) return;
      child += node::firstChild(open[parent]);
      const std::uint64_t bits = field.nodes[child];
      if (node::isLeaf(bits)) return visit(leafWithin(bits, depth, child, place, coordinates));
      next[number] = bits;
      any = true;
    });
    open = next;
    cells = children;
  }
}

/// Σ wₙ fₙ / Σ wₙ, by the differences to the first fₙ: what all agree on comes out to the bit.
template <typename Answer>
class Mixture;

template <>
class Mixture<double> {
 public:
  void add(const std::array<Ramp, 3>& ramps, double f) {
    if (weights_ == 0) first_ = f;
    const double weight = ramps[0].value * ramps[1].value * ramps[2].value;
    weights_ += weight;
    sum_ += weight * (f - first_);
  }
  double result() const { return first_ + sum_ / weights_; }

 private:
  double first_ = 0, weights_ = 0, sum_ = 0;
};

template <>
class Mixture<ValueAndGradient> {
 public:
  void add(const std::array<Ramp, 3>& ramps, const ValueAndGradient& f) {
    if (weights_ == 0) first_ = f;
    const auto& [x, y, z] = ramps;
    const double weight = x.value * y.value * z.value;
    const Vector3 slope(x.slope * y.value * z.value, x.value * y.slope * z.value, x.value * y.value * z.slope);
    const double difference = f.value - first_.value;
    weights_ += weight;
    sum_ += weight * difference;
    weightsGradient_ += slope;
    sumGradient_ += slope * difference + weight * (f.gradient - first_.gradient);
  }
  ValueAndGradient result() const {
    const double mean = sum_ / weights_;
    return {first_.value + mean, first_.gradient + (sumGradient_ - mean * weightsGradient_) / weights_};
  }

 private:
  ValueAndGradient first_{0, Vector3::Zero()};
  double weights_ = 0, sum_ = 0;
  Vector3 weightsGradient_ = Vector3::Zero(), sumGradient_ = Vector3::Zero();
};

template <typename Answer>
Answer answerOf(const FieldData& field, const GridFrame& frame, const FoundLeaf& leaf) {
  Answer result;
  std::visit([&](const auto& c) { answer(c.data(), frame, leaf, result); }, field.coefficients);
  return result;
}

/// At a point of the domain, in grid coordinates, of a leaf of this depth.
template <typename Answer>
Answer mixed(const FieldData& field, const LookupGrid& lookupGrid, const std::array<double, 3>& coordinates,
             int depth) {
  const GridFrame& frame = lookupGrid.frame;
  Mixture<Answer> mixture;
  visitReaching(field, lookupGrid, coordinates, depth, [&](const FoundLeaf& leaf) {
    std::array<Ramp, 3> ramps;
    for (int axis = 0; axis < 3; ++axis) {
      ramps[axis] = rampAlong(frame, leaf, axis, lookupGrid.blendExtents[leaf.number], field.blend);
      if (!(ramps[axis].value > 0)) return;
    }
    mixture.add(ramps, answerOf<Answer>(field, frame, leaf));
  });
  return mixture.result();
}

/// At a point near a face of its leaf.
template <typename Answer>
Answer blendedWithin(const FieldData& field, const LookupGrid& lookupGrid, const std::array<double, 3>& coordinates,
                     const FoundLeaf& leaf, unsigned near) {
  if (!std::has_single_bit(near)) return mixed<Answer>(field, lookupGrid, coordinates, leaf.depth);
  const GridFrame& frame = lookupGrid.frame;
  const int axis = std::countr_zero(near);
  GridPoint across{coordinates, {}, 0};
  for (int a = 0; a < 3; ++a) {
    across.fixed[a] = a == axis ? fixedAcross(leaf.place[a], leaf.depth, leaf.local[a] > 0)
                                : static_cast<std::int64_t>(coordinates[a] * (std::int64_t{1} << kMaxDepth));
    across.path |= pathAlong(a, across.fixed[a]);
  }
  if (across.fixed[axis] < 0 || across.fixed[axis] > frame.last[axis]) return answerOf<Answer>(field, frame, leaf);
  const FoundLeaf other = find(field, lookupGrid, across);
  if (!noThird(field, other.local, axis)) return mixed<Answer>(field, lookupGrid, coordinates, leaf.depth);
  const auto ramp = [&](const FoundLeaf& of) {
    return rampAlong(frame, of, axis, lookupGrid.blendExtents[of.number], field.blend);
  };
  return between(answerOf<Answer>(field, frame, leaf), ramp(leaf), answerOf<Answer>(field, frame, other), ramp(other),
                 axis);
}

/// The field at a point of the domain, which counts to a given leaf though it lie on its faces: the limit from within.
template <typename Answer>
Answer answerWithin(const FieldData& field, const LookupGrid& lookupGrid, const std::array<double, 3>& coordinates,
                    const FoundLeaf& leaf) {
  if (const unsigned near = nearAxes(field, leaf.local); near != 0)
    return blendedWithin<Answer>(field, lookupGrid, coordinates, leaf, near);
  return answerOf<Answer>(field, lookupGrid.frame, leaf);
}

}  // namespace hpsdf
