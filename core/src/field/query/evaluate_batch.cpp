#include "field/query/evaluate_batch.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <variant>

#include "field/query/blend.h"
#include "field/query/evaluate.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "field/query/evaluate_batch.cpp"
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hpsdf {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<double, 4>;
using Unsigned = hn::RebindToUnsigned<Tag>;
using Vec = hn::Vec<Tag>;
constexpr std::size_t kLanes = hn::MaxLanes(Tag());

/// A number for each of some points.
struct Lanes {
  Vec v;
  Lanes() = default;
  HWY_INLINE Lanes(Vec numbers) : v(numbers) {}
  HWY_INLINE explicit Lanes(double number) : v(hn::Set(Tag(), number)) {}
  HWY_INLINE Lanes& operator+=(Lanes b) { return *this = *this + b; }
  friend HWY_INLINE Lanes operator+(Lanes a, Lanes b) { return hn::Add(a.v, b.v); }
  friend HWY_INLINE Lanes operator-(Lanes a, Lanes b) { return hn::Sub(a.v, b.v); }
  friend HWY_INLINE Lanes operator*(Lanes a, Lanes b) { return hn::Mul(a.v, b.v); }
};

#include "basis/legendre-inl.h"
#include "field/query/polynomial-inl.h"

/// Enough that the loops below wait for memory together, few enough for the nearest cache.
constexpr std::size_t kBatch = 128;
static_assert(kBatch % kLanes == 0);

/// The degrees for which there is code in vectors, as in `withDegree`.
constexpr int kLeastCommon = 2, kMostCommon = 4;
constexpr std::size_t kLists = kMostCommon - kLeastCommon + 2;

constexpr double kOne = std::uint64_t{1} << kMaxDepth;

/// A point in its leaf.
struct Place {
  double local[3];
  double bits;  ///< of the leaf's node, with its depth as the lookup grid has it: not a number, but as wide as one
};

/// Points on their way to their leaves. There is room for whole vectors: the last point fills the last one.
struct Batch {
  const Vector3* points;
  std::size_t count;
  bool within;                                 ///< whether all lie in the domain
  HWY_ALIGN double coordinates[3][kBatch];     ///< as in GridPoint
  HWY_ALIGN double fixed[3][kBatch];           ///< as in GridPoint; whole numbers
  HWY_ALIGN std::uint64_t path[kBatch];        ///< as in GridPoint
  HWY_ALIGN std::uint64_t entry[kBatch];       ///< of the lookup grid
  std::uint64_t numbers[kBatch];               ///< of the leaves, as in FoundLeaf; without blending unknown
  HWY_ALIGN std::uint64_t bits[kBatch];        ///< of the nodes, with their depth as the lookup grid has it
  HWY_ALIGN Place places[kBatch];              ///< when the leaves are found
  std::uint8_t list[kLists][kBatch + kLanes];  ///< points in leaves of each common degree, then all others
  std::size_t listed[kLists];
};

/// The bits of whole numbers below 2^52.
HWY_INLINE hn::Vec<Unsigned> integers(Vec whole) {
  constexpr auto kImplicit = std::uint64_t{1} << 52;
  return hn::And(hn::BitCast(Unsigned(), whole + hn::Set(Tag(), double(kImplicit))),
                 hn::Set(Unsigned(), kImplicit - 1));
}

/// 2^depth.
HWY_INLINE Vec scaleOf(hn::Vec<Unsigned> bits) {
  const auto depth = hn::And(hn::ShiftRight<40>(bits), hn::Set(Unsigned(), 0xff));
  return hn::BitCast(Tag(), hn::ShiftLeft<52>(depth + hn::Set(Unsigned(), 1023)));
}

/// `closestWithin` and `gridPoint` in vectors, and whole numbers kept as double, which is exact.
void enterGrid(const LookupGrid& lookupGrid, Batch& batch) {
  const Tag d;
  const auto number = [&](auto value) HWY_ATTR { return hn::Set(d, static_cast<double>(value)); };
  const GridFrame& frame = lookupGrid.frame;
  const auto one = number(kOne), fromFixed = number(std::ldexp(1.0, lookupGrid.depth - kMaxDepth));
  auto within = hn::FirstN(d, kLanes);
  for (std::size_t i = 0; i < batch.count; i += kLanes) {
    const Vector3* from = batch.points + i;
    std::array<Vector3, kLanes> last;
    if (i + kLanes > batch.count) {
      for (std::size_t lane = 0; lane < kLanes; ++lane) last[lane] = batch.points[std::min(i + lane, batch.count - 1)];
      from = last.data();
    }
    Vec x[3], cell[3];
    hn::LoadInterleaved3(d, from->data(), x[0], x[1], x[2]);
    auto path = hn::Zero(Unsigned());
    for (int axis = 0; axis < 3; ++axis) {
      const auto lower = number(frame.lower[axis]);
      const auto closest = hn::IfThenElse(x[axis] > lower, hn::Min(x[axis], number(frame.upper[axis])), lower);
      within = hn::And(within, closest == x[axis]);
      const auto coordinate = ((closest - lower) / number(frame.size[axis])) * number(frame.cells[axis]);
      const auto fixed = hn::Min(hn::Floor(coordinate * one), number(frame.last[axis]));
      hn::Store(coordinate, d, batch.coordinates[axis] + i);
      hn::Store(fixed, d, batch.fixed[axis] + i);
      const auto digits = hn::And(integers(fixed), hn::Set(Unsigned(), (std::uint64_t{1} << kMaxDepth) - 1));
      path = hn::Or(path, hn::ShiftLeftSame(digits, 21 * axis));
      cell[axis] = hn::Floor(fixed * fromFixed);
    }
    hn::Store(path, Unsigned(), batch.path + i);
    hn::Store(integers(cell[2] * number(lookupGrid.slab) + cell[1] * number(lookupGrid.row) + cell[0]), Unsigned(),
              batch.entry + i);
  }
  batch.within = hn::AllTrue(d, within);
}

/// Level by level, so that the points' nodes are fetched all at once. A point is put on the list of those that go on
/// whether it does or not, and then counted or not: a branch would be mispredicted.
template <bool WithNumbers>
void descend(const FieldData& field, const LookupGrid& lookupGrid, Batch& batch) {
  std::uint8_t waiting[kBatch];
  std::size_t count = 0;
  const auto reach = [&](std::size_t i, std::size_t number, std::uint64_t bits) {
    if constexpr (WithNumbers) batch.numbers[i] = number;
    batch.bits[i] = bits;
    waiting[count] = static_cast<std::uint8_t>(i);
    count += !node::isLeaf(bits);
  };
  for (std::size_t i = 0; i < batch.count; ++i)
    reach(i, field.nodes.size() + batch.entry[i], lookupGrid.entries[batch.entry[i]]);
  for (int depth = lookupGrid.depth + 1; count > 0; ++depth) {
    const std::size_t before = std::exchange(count, 0);
    for (std::size_t n = 0; n < before; ++n) {
      const std::size_t i = waiting[n];
      const std::uint32_t child = node::firstChild(batch.bits[i]) + childOnPath(batch.path[i], depth);
      reach(i, child, LookupGrid::entry(field.nodes[child], depth));
    }
  }
  for (std::size_t i = batch.count; i % kLanes != 0; ++i) batch.bits[i] = batch.bits[i - 1];
}

/// Lists the points by degree, in the manner of `descend`, and has their coefficients fetched.
template <typename T>
void sortByDegree(const T* coefficients, Batch& batch) {
  std::array<std::size_t, kLists> listed{};
  for (std::size_t i = 0; i < batch.count; ++i) {
    const int degree = node::degree(batch.bits[i]);
    const T* first = coefficients + node::offset(batch.bits[i]);
    const std::size_t last = coefficientCount(degree) - 1;
    // for all leaves what the common ones take at most: as many as each takes would be mispredicted
    for (std::size_t at = 0; at < coefficientCount(kMostCommon); at += 64 / sizeof(T))
      __builtin_prefetch(first + std::min(at, last));
    for (std::size_t k = 0; k < kLists; ++k) batch.list[k][listed[k]] = static_cast<std::uint8_t>(i);
    for (std::size_t k = 0; k + 1 < kLists; ++k) listed[k] += degree == kLeastCommon + int(k);
    listed[kLists - 1] += degree < kLeastCommon || degree > kMostCommon;
  }
  for (std::size_t k = 0; k < kLists; ++k) {
    if (listed[k] > 0) std::fill_n(batch.list[k] + listed[k], kLanes - 1, batch.list[k][listed[k] - 1]);
    batch.listed[k] = listed[k];
  }
}

/// Local coordinates, as in `find`.
void enterLeaves(Batch& batch) {
  const Tag d;
  for (std::size_t i = 0; i < batch.count; i += kLanes) {
    const auto bits = hn::Load(Unsigned(), batch.bits + i);
    const auto scale = scaleOf(bits), fromFixed = scale * hn::Set(d, 1 / kOne);
    Vec local[3];
    for (int axis = 0; axis < 3; ++axis) {
      const auto cell = hn::Floor(hn::Load(d, batch.fixed[axis] + i) * fromFixed);
      local[axis] = hn::Set(d, 2.0) * (hn::Load(d, batch.coordinates[axis] + i) * scale - cell) - hn::Set(d, 1.0);
    }
    hn::StoreInterleaved4(local[0], local[1], local[2], hn::BitCast(d, bits), d, batch.places[i].local);
  }
}

HWY_INLINE Vec load(const double* from) { return hn::LoadU(Tag(), from); }
HWY_INLINE Vec load(const float* from) { return hn::PromoteTo(Tag(), hn::LoadU(hn::Rebind<float, Tag>(), from)); }

/// Lane l of out[i] becomes from[l][i], for as many i as there are lanes.
template <typename T>
HWY_INLINE void loadTransposed(const std::array<const T*, kLanes>& from, std::size_t offset, Lanes* out) {
#if HWY_TARGET == HWY_SCALAR
  out[0] = load(from[0] + offset);
#else
  const Tag d;
  const auto pair = [&](std::size_t lane, Vec& even, Vec& odd) HWY_ATTR {
    const Vec a = load(from[lane] + offset), b = load(from[lane + 1] + offset);
    even = hn::InterleaveLower(d, a, b);
    odd = hn::InterleaveUpper(d, a, b);
  };
  if constexpr (kLanes == 2) {
    pair(0, out[0].v, out[1].v);
  } else {
    Vec even[2], odd[2];
    pair(0, even[0], odd[0]);
    pair(2, even[1], odd[1]);
    out[0] = hn::ConcatLowerLower(d, even[1], even[0]);
    out[1] = hn::ConcatLowerLower(d, odd[1], odd[0]);
    out[2] = hn::ConcatUpperUpper(d, even[1], even[0]);
    out[3] = hn::ConcatUpperUpper(d, odd[1], odd[0]);
  }
#endif
}

template <typename T, std::size_t Count>
HWY_INLINE void loadAllTransposed(const std::array<const T*, kLanes>& from, std::array<Lanes, Count>& out) {
  for (std::size_t i = 0; i < Count; i += kLanes) {
    const std::size_t at = std::min(i, Count - kLanes);  // never beyond the end
    loadTransposed(from, at, out.data() + at);
  }
}

/// `answer` at the points of a common degree's list, a vector of them at a time. At the list's end the last one stands
/// in for those that are missing, and is answered repeatedly.
template <int P, typename T, typename Answer>
void answerList(const T* coefficients, const GridFrame& frame, const Batch& batch, Answer* out) {
  const Tag d;
  for (std::size_t n = 0; n < batch.listed[P - kLeastCommon]; n += kLanes) {
    const std::uint8_t* points = batch.list[P - kLeastCommon] + n;
    std::array<const double*, kLanes> places;
    std::array<const T*, kLanes> leaves;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      places[lane] = batch.places[points[lane]].local;
      leaves[lane] = coefficients + node::offset(batch.bits[points[lane]]);
    }
    std::array<Lanes, 4> place;
    std::array<Lanes, coefficientCount(P)> c;
    loadAllTransposed(places, place);
    loadAllTransposed(leaves, c);
    const std::array<Lanes, 3> local = {place[0], place[1], place[2]};
    if constexpr (std::is_same_v<Answer, double>) {
      HWY_ALIGN double value[kLanes];
      hn::Store(evaluateAt(c.data(), Constant<P>(), local).v, d, value);
      for (std::size_t lane = 0; lane < kLanes; ++lane) out[points[lane]] = value[lane];
    } else {
      const auto result = evaluateWithGradientAt(c.data(), Constant<P>(), local);
      const auto scale = hn::Set(d, 2.0) * scaleOf(hn::BitCast(Unsigned(), place[3].v));
      HWY_ALIGN double number[4][kLanes];
      hn::Store(result[0].v, d, number[0]);
      for (int axis = 0; axis < 3; ++axis) {
        const auto toWorld = scale * hn::Set(d, frame.cells[axis]) / hn::Set(d, frame.size[axis]);
        hn::Store(result[axis + 1].v * toWorld, d, number[axis + 1]);
      }
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        out[points[lane]] = {number[0][lane], {number[1][lane], number[2][lane], number[3][lane]}};
    }
  }
}

template <typename T, typename Answer>
void answerLeaves(const T* coefficients, const GridFrame& frame, const Batch& batch, Answer* out) {
  upTo(Constant<kMostCommon - kLeastCommon>(),
       [&](auto k) { answerList<kLeastCommon + k>(coefficients, frame, batch, out); });
  for (std::size_t n = 0; n < batch.listed[kLists - 1]; ++n) {
    const std::size_t i = batch.list[kLists - 1][n];
    const auto& local = batch.places[i].local;
    const FoundLeaf leaf{batch.bits[i], LookupGrid::depthOf(batch.bits[i]), {local[0], local[1], local[2]}, {}, 0};
    answer(coefficients, frame, leaf, out[i]);
  }
}

HWY_INLINE FoundLeaf leafOf(const Batch& batch, std::size_t i) {
  const auto& local = batch.places[i].local;
  const int depth = LookupGrid::depthOf(batch.bits[i]);
  FoundLeaf leaf{batch.bits[i], depth, {local[0], local[1], local[2]}, {}, batch.numbers[i]};
  for (int axis = 0; axis < 3; ++axis)
    leaf.place[axis] = static_cast<std::int64_t>(batch.fixed[axis][i]) >> (kMaxDepth - depth);
  return leaf;
}

/// The points near one face of their leaves, each on the way to the leaf across.
struct Across {
  Batch batch;
  std::uint8_t point[kBatch];
  std::uint8_t axis[kBatch];
};

/// As `blendedWithin`, for all points that others' leaves may reach, whose own leaves have answered already.
template <typename T, typename Answer>
void blend(const FieldData& field, const LookupGrid& lookupGrid, const T* coefficients, const Batch& batch,
           Answer* out) {
  const GridFrame& frame = lookupGrid.frame;
  const auto mixAt = [&](std::size_t i) {
    out[i] =
        mixed<Answer>(field, lookupGrid, {batch.coordinates[0][i], batch.coordinates[1][i], batch.coordinates[2][i]},
                      LookupGrid::depthOf(batch.bits[i]));
  };
  std::uint8_t points[kBatch], near[kBatch];
  std::size_t count = 0;
  for (std::size_t i = 0; i < batch.count; ++i) {
    const double* local = batch.places[i].local;
    points[count] = static_cast<std::uint8_t>(i);
    near[count] = static_cast<std::uint8_t>(nearAxes(field, {local[0], local[1], local[2]}));
    count += near[count] != 0;
  }
  Across across;
  Batch& others = across.batch;
  others.count = 0;
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t i = points[n];
    if (!std::has_single_bit(near[n])) {
      mixAt(i);
      continue;
    }
    const int axis = std::countr_zero(near[n]);
    const int depth = LookupGrid::depthOf(batch.bits[i]);
    const auto place = static_cast<std::int64_t>(batch.fixed[axis][i]) >> (kMaxDepth - depth);
    const std::int64_t fixed = fixedAcross(place, depth, batch.places[i].local[axis] > 0);
    if (fixed < 0 || fixed > frame.last[axis]) continue;
    const std::size_t other = others.count++;
    across.point[other] = points[n];
    across.axis[other] = static_cast<std::uint8_t>(axis);
    const int shift = kMaxDepth - lookupGrid.depth;
    const std::int64_t step = axis == 0 ? 1 : axis == 1 ? lookupGrid.row : lookupGrid.slab;
    const auto before = static_cast<std::int64_t>(batch.fixed[axis][i]);
    for (int a = 0; a < 3; ++a) {
      others.coordinates[a][other] = batch.coordinates[a][i];
      others.fixed[a][other] = batch.fixed[a][i];
    }
    others.fixed[axis][other] = static_cast<double>(fixed);
    others.path[other] = batch.path[i] ^ pathAlong(axis, before) ^ pathAlong(axis, fixed);
    others.entry[other] = batch.entry[i] + ((fixed >> shift) - (before >> shift)) * step;
  }
  if (others.count == 0) return;
  descend<true>(field, lookupGrid, others);
  sortByDegree(coefficients, others);
  enterLeaves(others);
  Answer answers[kBatch];
  answerLeaves(coefficients, frame, others, answers);
  for (std::size_t other = 0; other < others.count; ++other) {
    const std::size_t i = across.point[other];
    const int axis = across.axis[other];
    const FoundLeaf one = leafOf(batch, i), two = leafOf(others, other);
    if (!noThird(field, two.local, axis)) {
      mixAt(i);
      continue;
    }
    const auto ramp = [&](const FoundLeaf& of) {
      return rampAlong(frame, of, axis, lookupGrid.blendExtents[of.number], field.blend);
    };
    out[i] = between(out[i], ramp(one), answers[other], ramp(two), axis);
  }
}

template <typename Answer>
void continueOutside(const GridFrame& frame, const Batch& batch, Answer* out) {
  if (batch.within) return;
  for (std::size_t i = 0; i < batch.count; ++i)
    if (!contains(frame, batch.points[i])) extend(batch.points[i] - closestWithin(frame, batch.points[i]), out[i]);
}

template <typename Answer>
void answerAll(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
               std::span<Answer> out) {
  Batch batch;
  for (std::size_t first = 0; first < points.size(); first += kBatch) {
    batch.points = points.data() + first;
    batch.count = std::min(kBatch, points.size() - first);
    enterGrid(lookupGrid, batch);
    if (field.blend > 0)
      descend<true>(field, lookupGrid, batch);
    else
      descend<false>(field, lookupGrid, batch);
    std::visit(
        [&](const auto& c) {
          sortByDegree(c.data(), batch);
          enterLeaves(batch);
          answerLeaves(c.data(), lookupGrid.frame, batch, out.data() + first);
          if (field.blend > 0) blend(field, lookupGrid, c.data(), batch, out.data() + first);
          continueOutside(lookupGrid.frame, batch, out.data() + first);
        },
        field.coefficients);
  }
}

void values(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
            std::span<double> out) {
  answerAll(field, lookupGrid, points, out);
}

void valuesAndGradients(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
                        std::span<ValueAndGradient> out) {
  answerAll(field, lookupGrid, points, out);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace hpsdf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hpsdf {

HWY_EXPORT(values);
HWY_EXPORT(valuesAndGradients);

void answerBatch(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
                 std::span<double> out) {
  HWY_DYNAMIC_DISPATCH(values)(field, lookupGrid, points, out);
}

void answerBatch(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
                 std::span<ValueAndGradient> out) {
  HWY_DYNAMIC_DISPATCH(valuesAndGradients)(field, lookupGrid, points, out);
}

}  // namespace hpsdf
#endif
