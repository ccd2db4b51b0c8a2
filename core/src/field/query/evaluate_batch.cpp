#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "field/query/blend.h"
#include "field/query/evaluate.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "field/query/evaluate_batch.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include to follow foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hpsdf::query {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<double, 8>;
using Unsigned = hn::RebindToUnsigned<Tag>;
using Vec = hn::Vec<Tag>;
constexpr std::size_t kLanes = hn::MaxLanes(Tag());

/// A SIMD vector with one double for each of several points. Thanks to its operators, the templates that evaluate
/// polynomials accept it in place of a number.
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

/// A SIMD vector with one word of 64 bits for each of several leaves.
struct LaneWords {
  hn::Vec<Unsigned> v;
  HWY_INLINE LaneWords(hn::Vec<Unsigned> words) : v(words) {}
  HWY_INLINE explicit LaneWords(std::uint64_t word) : v(hn::Set(Unsigned(), word)) {}
  friend HWY_INLINE LaneWords operator+(LaneWords a, LaneWords b) { return hn::Add(a.v, b.v); }
  friend HWY_INLINE LaneWords operator-(LaneWords a, LaneWords b) { return hn::Sub(a.v, b.v); }
  friend HWY_INLINE LaneWords operator&(LaneWords a, LaneWords b) { return hn::And(a.v, b.v); }
  friend HWY_INLINE LaneWords operator|(LaneWords a, LaneWords b) { return hn::Or(a.v, b.v); }
  friend HWY_INLINE LaneWords operator<<(LaneWords a, LaneWords count) { return hn::Shl(a.v, count.v); }
  friend HWY_INLINE LaneWords operator>>(LaneWords a, LaneWords count) { return hn::Shr(a.v, count.v); }
};

/// Returns N times each word.
template <int N>
HWY_INLINE LaneWords times(LaneWords words) {
  if constexpr (N == 1) {
    return words;
  } else {
    const LaneWords even(hn::ShiftLeft<1>(times<N / 2>(words).v));
    return N % 2 == 0 ? even : even + words;
  }
}
HWY_INLINE bool isZero(LaneWords a) { return hn::AllTrue(Unsigned(), hn::Eq(a.v, hn::Zero(Unsigned()))); }
HWY_INLINE LaneWords orAnd(LaneWords a, LaneWords b, LaneWords c) { return hn::OrAnd(a.v, b.v, c.v); }
HWY_INLINE Lanes asNumber(LaneWords words) { return hn::BitCast(Tag(), words.v); }

/// Loads the words that begin at `Count` places in an array of bytes. This is faster than a gather, and than a load of
/// words that have just been stored one by one.
template <std::size_t Count>
HWY_INLINE auto wordsAt(const std::uint8_t* bytes, const std::uint64_t* at) {
  const hn::FixedTag<std::uint64_t, Count> d;
#if HWY_TARGET != HWY_SCALAR
  if constexpr (Count > 1)
    return hn::Combine(d, wordsAt<Count / 2>(bytes, at + Count / 2), wordsAt<Count / 2>(bytes, at));
  else
#endif
    return hn::LoadU(d, reinterpret_cast<const std::uint64_t*>(bytes + *at));
}

/// The bits of several leaves in an array of bytes, in the form that decodeLeaves takes.
struct LanesOfBits {
  const std::uint8_t* bytes;
  std::array<std::uint64_t, kLanes> offsets;  ///< the first byte of each leaf in the array
  hn::Vec<Unsigned> begins;                   ///< the first bit of each leaf in the array

  HWY_INLINE LaneWords begin() const { return begins; }
  HWY_INLINE LaneWords head() const { return wordsAt<kLanes>(bytes, offsets.data()); }

  /// Returns for each leaf at least 57 bits from a bit of the leaf on, the first in the lowest bit. The bit is the same
  /// in all leaves.
  HWY_INLINE LaneWords readAllAt(std::uint32_t position) const {
    return LaneWords(wordsAt<kLanes>(bytes + (position >> 3), offsets.data())) >> LaneWords(position & 7);
  }

  /// Returns as many bits of each leaf from a bit of the array on.
  HWY_INLINE LaneWords read(LaneWords position) const {
    HWY_ALIGN std::uint64_t at[kLanes];
    hn::Store(hn::ShiftRight<3>(position.v), Unsigned(), at);
    return LaneWords(wordsAt<kLanes>(bytes, at)) >> (position & LaneWords(7));
  }
};

#include "basis/legendre-inl.h"
#include "field/query/polynomial-inl.h"
#include "field/query/quantized-inl.h"

/// Number of points in a batch: large enough that loops over a batch overlap their memory accesses and that few lanes
/// are left over at the end of each list, small enough for a batch to fit into the L1 cache.
constexpr std::size_t kBatch = kLanes > 4 ? 256 : 128;
static_assert(kBatch % kLanes == 0 && kBatch <= 256, "the indices of a batch fit into a byte");

/// The lowest and the highest polynomial degree with SIMD code. `withDegree` has compile-time constants for the
/// same degrees.
constexpr int kMinVectorDegree = 1, kMaxVectorDegree = 5;

/// Number of lists into which the points of a batch are sorted: one for each degree with SIMD code, and one for
/// all other degrees.
constexpr std::size_t kLists = kMaxVectorDegree - kMinVectorDegree + 2;

/// A point in the local coordinates of its leaf. `bits` is the 64-bit word from `LookupGrid::entry`, which contains the
/// leaf's node and depth. It is declared as a double so that all four numbers can be loaded at once.
struct PackedLeafPoint {
  double local[3];
  double bits;
};

/// A batch of points during their descent in the octree. Every array has room for whole SIMD vectors. Copies of
/// the last point fill the last vector.
struct Batch {
  const Vector3* points;
  std::size_t count;
  bool allInDomain;
  HWY_ALIGN double coordinates[3][kBatch];        ///< grid coordinates, in which base cells are unit cubes
  HWY_ALIGN double fixedPoint[3][kBatch];         ///< grid coordinates as fixed-point integers, exact in double
  HWY_ALIGN std::uint64_t path[kBatch];           ///< octree paths: the bits that select a child at each depth
  HWY_ALIGN std::uint64_t entry[kBatch];          ///< index into `LookupGrid::entries`
  std::uint64_t blendExtentsIndex[kBatch];        ///< index into `LookupGrid::blendExtents`; only for blending
  HWY_ALIGN std::uint64_t bits[kBatch];           ///< octree nodes with their depths in bits 40 to 47
  HWY_ALIGN PackedLeafPoint leafPoints[kBatch];   ///< set when all leaves are found
  std::uint32_t listed[kLists][kBatch + kLanes];  ///< indices of the points in each list
  std::size_t listedCount[kLists];
};

/// Converts non-negative integers below 2^52 from double to unsigned.
HWY_INLINE hn::Vec<Unsigned> toUnsigned(Vec integers) {
  constexpr auto kImplicit = std::uint64_t{1} << 52;
  return hn::And(hn::BitCast(Unsigned(), integers + hn::Set(Tag(), double(kImplicit))),
                 hn::Set(Unsigned(), kImplicit - 1));
}

/// Returns 2^depth for nodes whose depth is stored in the same 64-bit word.
HWY_INLINE Vec depthScale(hn::Vec<Unsigned> bits) {
  const auto depth = hn::And(hn::ShiftRight<40>(bits), hn::Set(Unsigned(), 0xff));
  return hn::BitCast(Tag(), hn::ShiftLeft<52>(depth + hn::Set(Unsigned(), 1023)));
}

/// Maps the points of a batch to grid coordinates, in the same way as `closestInDomain` and `gridPoint`.
void enterGrid(const LookupGrid& lookupGrid, Batch& batch) {
  const Tag d;
  const auto number = [&](auto value) HWY_ATTR { return hn::Set(d, static_cast<double>(value)); };
  const GridFrame& frame = lookupGrid.frame;
  const auto one = number(kFixedPointOne), fromFixedPoint = number(std::ldexp(1.0, lookupGrid.depth - kMaxDepth));
  auto inDomain = hn::FirstN(d, kLanes);
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
      inDomain = hn::And(inDomain, closest == x[axis]);
      const auto coordinate = ((closest - lower) / number(frame.size[axis])) * number(frame.cells[axis]);
      const auto fixedPoint = hn::Min(hn::Floor(coordinate * one), number(frame.last[axis]));
      hn::Store(coordinate, d, batch.coordinates[axis] + i);
      hn::Store(fixedPoint, d, batch.fixedPoint[axis] + i);
      const auto digits = hn::And(toUnsigned(fixedPoint), hn::Set(Unsigned(), kFixedPointOne - 1));
      path = hn::Or(path, hn::ShiftLeftSame(digits, 21 * axis));
      cell[axis] = hn::Floor(fixedPoint * fromFixedPoint);
    }
    hn::Store(path, Unsigned(), batch.path + i);
    hn::Store(toUnsigned(cell[2] * number(lookupGrid.slab) + cell[1] * number(lookupGrid.row) + cell[0]), Unsigned(),
              batch.entry + i);
  }
  batch.allInDomain = hn::AllTrue(d, inDomain);
}

/// Finds the leaves of all points in a batch, depth by depth, so that the nodes of all points are fetched at
/// once. Every point is written to the list of points that descend further, but the length of this list grows
/// only for internal nodes. This avoids a branch that would be mispredicted.
template <bool WithBlendExtents>
void descend(const FieldData& field, const LookupGrid& lookupGrid, Batch& batch) {
  std::uint8_t descending[kBatch];
  std::size_t count = 0;
  const auto enterNode = [&](std::size_t i, std::size_t index, std::uint64_t bits) {
    if constexpr (WithBlendExtents) batch.blendExtentsIndex[i] = index;
    batch.bits[i] = bits;
    descending[count] = static_cast<std::uint8_t>(i);
    count += !node::isLeaf(bits);
  };
  for (std::size_t i = 0; i < batch.count; ++i)
    enterNode(i, field.nodes.size() + batch.entry[i], lookupGrid.entries[batch.entry[i]]);
  for (int depth = lookupGrid.depth + 1; count > 0; ++depth) {
    const std::size_t before = std::exchange(count, 0);
    for (std::size_t n = 0; n < before; ++n) {
      const std::size_t i = descending[n];
      const std::uint32_t child = node::firstChild(batch.bits[i]) + childOnPath(batch.path[i], depth);
      enterNode(i, child, LookupGrid::entry(field.nodes[child], depth));
    }
  }
  for (std::size_t i = batch.count; i % kLanes != 0; ++i) batch.bits[i] = batch.bits[i - 1];
}

/// The highest degree all of whose coefficients are prefetched. Higher degrees are rare.
constexpr int kPrefetchedDegree = 4;

/// Prefetches the coefficients of a leaf: the same number of cache lines for each leaf, because a varying end of the
/// loop would be mispredicted.
template <typename T>
HWY_INLINE void prefetch(const FieldArray<T>& coefficients, std::size_t offset, int degree) {
  const std::size_t last = coefficientCount(degree) - 1;
  for (std::size_t at = 0; at < coefficientCount(kPrefetchedDegree); at += 64 / sizeof(T))
    __builtin_prefetch(coefficients.data() + offset + std::min(at, last));
}

/// A quantized leaf of up to degree 4 takes at most 32 bytes, nearly always.
HWY_INLINE void prefetch(const QuantizedCoefficients& coefficients, std::size_t offset, int /*degree*/) {
  __builtin_prefetch(coefficients.bytes.data() + offset);
  __builtin_prefetch(coefficients.bytes.data() + std::min(offset + 31, coefficients.bytes.size() - 1));
}

template <typename Coefficients>
HWY_INLINE void prefetchLeaf(const Coefficients& coefficients, std::uint64_t leaf) {
  const bool isExact = node::isExact(leaf);
  prefetch(coefficients, isExact ? 0 : node::offset(leaf), isExact ? 0 : node::degree(leaf));
}

/// The bits of a node by which points are grouped, in the node's upper half: the degree, and whether the leaf is wide.
constexpr std::uint32_t kKeyBits = (node::quantizedLeaf(0xff, 0, true, 0) & ~node::kLeafBit) >> 32;

/// Adds the points of one SIMD vector, the first of which is point `first`, to the lists of their leaves' degrees. No
/// branch depends on the degree.
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3  // better targets have lower numbers
HWY_INLINE void listPoints(std::size_t first, Batch& batch, std::array<std::size_t, kLists>& counts) {
  const hn::Rebind<std::uint32_t, Tag> d;
  const auto points = hn::Iota(d, static_cast<std::uint32_t>(first));
  const auto upper = hn::TruncateTo(d, hn::ShiftRight<32>(hn::Load(Unsigned(), batch.bits + first)));
  const auto key = hn::And(upper, hn::Set(d, kKeyBits));
  const auto add = [&](std::size_t list, auto mask) HWY_ATTR {
    // To compress in a register and then store is faster than CompressStore on some processors.
    hn::StoreU(hn::Compress(points, mask), d, batch.listed[list] + counts[list]);
    counts[list] += hn::CountTrue(d, mask);
  };
  auto others = hn::FirstN(d, batch.count - first);
  for (std::size_t k = 0; k + 1 < kLists; ++k) {
    const auto hasDegree = hn::Eq(key, hn::Set(d, std::uint32_t(kMinVectorDegree + k)));
    add(k, hn::And(others, hasDegree));
    others = hn::AndNot(hasDegree, others);
  }
  add(kLists - 1, others);
}
#else
HWY_INLINE void listPoints(std::size_t first, Batch& batch, std::array<std::size_t, kLists>& counts) {
  for (std::size_t i = first; i < std::min(first + kLanes, batch.count); ++i) {
    const auto key = static_cast<std::uint32_t>(batch.bits[i] >> 32) & kKeyBits;
    for (std::size_t k = 0; k < kLists; ++k) batch.listed[k][counts[k]] = static_cast<std::uint32_t>(i);
    for (std::size_t k = 0; k + 1 < kLists; ++k) counts[k] += key == kMinVectorDegree + k;
    counts[kLists - 1] += key - kMinVectorDegree > kMaxVectorDegree - kMinVectorDegree;
  }
}
#endif

/// Throws `Error` if coefficients of the leaves of a batch lie in a mapped file that is damaged.
template <typename Coefficients>
void requireLeaves(const Coefficients& coefficients, const Batch& batch) {
  for (std::size_t i = 0; i < batch.count; ++i)
    if (!node::isExact(batch.bits[i])) leafOf(coefficients, batch.bits[i]);
}

/// Groups the points of a batch by the degree of their leaves, and prefetches the leaves' coefficients. Wide leaves
/// have no SIMD code.
template <typename Coefficients>
void listByDegree(const Coefficients& coefficients, Batch& batch) {
  if (arrayOf(coefficients).isMapped()) [[unlikely]]
    requireLeaves(coefficients, batch);
  std::array<std::size_t, kLists> counts{};
  for (std::size_t i = 0; i < batch.count; i += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) prefetchLeaf(coefficients, batch.bits[i + lane]);
    listPoints(i, batch, counts);
  }
  for (std::size_t k = 0; k < kLists; ++k) {
    if (counts[k] > 0) std::fill_n(batch.listed[k] + counts[k], kLanes - 1, batch.listed[k][counts[k] - 1]);
    batch.listedCount[k] = counts[k];
  }
}

/// Computes the local coordinates of the points in their leaves, in the same way as `leafPoint`.
void enterLeaves(Batch& batch) {
  const Tag d;
  for (std::size_t i = 0; i < batch.count; i += kLanes) {
    const auto bits = hn::Load(Unsigned(), batch.bits + i);
    const auto scale = depthScale(bits), fromFixedPoint = scale * hn::Set(d, 1 / double(kFixedPointOne));
    Vec local[3];
    for (int axis = 0; axis < 3; ++axis) {
      const auto cell = hn::Floor(hn::Load(d, batch.fixedPoint[axis] + i) * fromFixedPoint);
      local[axis] = hn::Set(d, 2.0) * (hn::Load(d, batch.coordinates[axis] + i) * scale - cell) - hn::Set(d, 1.0);
    }
    hn::StoreInterleaved4(local[0], local[1], local[2], hn::BitCast(d, bits), d, batch.leafPoints[i].local);
  }
}

/// The lanes that are transposed together. A vector with more lanes is joined from such blocks.
using Block = hn::CappedTag<double, 4>;
using BlockVec = hn::Vec<Block>;
constexpr std::size_t kBlockLanes = hn::MaxLanes(Block());

HWY_INLINE BlockVec load(const double* from) { return hn::LoadU(Block(), from); }
HWY_INLINE BlockVec load(const float* from) {
  return hn::PromoteTo(Block(), hn::LoadU(hn::Rebind<float, Block>(), from));
}

/// Loads from `kBlockLanes` arrays and transposes: sets lane l of out[i] to from[l][offset + i], for each i below
/// `kBlockLanes`.
template <typename T>
HWY_INLINE void loadBlockTransposed(const T* const* from, std::size_t offset, BlockVec* out) {
#if HWY_TARGET == HWY_SCALAR
  out[0] = load(from[0] + offset);
#else
  const Block d;
  const auto pair = [&](std::size_t lane, BlockVec& even, BlockVec& odd) HWY_ATTR {
    const BlockVec a = load(from[lane] + offset), b = load(from[lane + 1] + offset);
    even = hn::InterleaveLower(d, a, b);
    odd = hn::InterleaveUpper(d, a, b);
  };
  if constexpr (kBlockLanes == 2) {
    pair(0, out[0], out[1]);
  } else {
    BlockVec even[2], odd[2];
    pair(0, even[0], odd[0]);
    pair(2, even[1], odd[1]);
    out[0] = hn::ConcatLowerLower(d, even[1], even[0]);
    out[1] = hn::ConcatLowerLower(d, odd[1], odd[0]);
    out[2] = hn::ConcatUpperUpper(d, even[1], even[0]);
    out[3] = hn::ConcatUpperUpper(d, odd[1], odd[0]);
  }
#endif
}

/// Loads from an array for each lane, like `loadBlockTransposed`.
template <typename T>
HWY_INLINE void loadTransposed(const std::array<const T*, kLanes>& from, std::size_t offset, Lanes* out) {
  BlockVec block[kBlockLanes];
  loadBlockTransposed(from.data(), offset, block);
#if HWY_MAX_BYTES >= 64  // a vector is two blocks
  BlockVec upper[kBlockLanes];
  loadBlockTransposed(from.data() + kBlockLanes, offset, upper);
  for (std::size_t i = 0; i < kBlockLanes; ++i) out[i] = hn::Combine(Tag(), upper[i], block[i]);
#else
  for (std::size_t i = 0; i < kBlockLanes; ++i) out[i] = block[i];
#endif
}

template <typename T, std::size_t Count>
HWY_INLINE void loadAllTransposed(const std::array<const T*, kLanes>& from, std::array<Lanes, Count>& out) {
  for (std::size_t i = 0; i < Count; i += kBlockLanes) {
    const std::size_t at = std::min(i, Count - kBlockLanes);  // The last step overlaps the one before to stay in range.
    loadTransposed(from, at, out.data() + at);
  }
}

/// The leaves of several points, one for each lane.
struct LaneLeaves {
  std::array<std::uint64_t, kLanes> offsets;  ///< of the leaves' coefficients
  Lanes bits;                                 ///< packed nodes
};

/// Loads the coefficients of several leaves of degree P.
template <int P, typename T>
HWY_INLINE void loadLeaves(const FieldArray<T>& coefficients, const LaneLeaves& leaves,
                           std::array<Lanes, coefficientCount(P)>& out) {
  std::array<const T*, kLanes> from;
  for (std::size_t lane = 0; lane < kLanes; ++lane) from[lane] = coefficients.data() + leaves.offsets[lane];
  loadAllTransposed(from, out);
}

/// Quantized coefficients are loaded in units of the step.
template <int P>
HWY_INLINE void loadLeaves(const QuantizedCoefficients& coefficients, const LaneLeaves& leaves,
                           std::array<Lanes, coefficientCount(P)>& out) {
  // A vector of the offsets that have just been stored one by one would have to wait for them.
  const auto offsets = hn::And(hn::BitCast(Unsigned(), leaves.bits.v), hn::Set(Unsigned(), 0xffffffff));
  decodeLeaves<P>(LanesOfBits{coefficients.bytes.data(), leaves.offsets, hn::ShiftLeft<3>(offsets)},
                  coefficients.meanBits, out.data());
}

/// Returns loaded coefficients in the form that `evaluatePolynomial` takes.
template <int P, typename T>
HWY_INLINE const Lanes* asCoefficients(const FieldArray<T>& /*coefficients*/, const Lanes* loaded) {
  return loaded;
}
template <int P>
HWY_INLINE OrthonormalIntegers<P, Lanes> asCoefficients(const QuantizedCoefficients& /*coefficients*/,
                                                        const Lanes* loaded) {
  return {loaded};
}

/// Converts results from the unit of loaded coefficients to that of the field. `bits` are the packed nodes.
template <typename T>
HWY_INLINE Vec inUnits(const FieldArray<T>& /*coefficients*/, Lanes /*bits*/, Vec result) {
  return result;
}
HWY_INLINE Vec inUnits(const QuantizedCoefficients& coefficients, Lanes bits, Vec result) {
  const auto shift = hn::And(hn::ShiftRight<48>(hn::BitCast(Unsigned(), bits.v)), hn::Set(Unsigned(), 31));
  const auto step = hn::BitCast(Unsigned(), hn::Set(Tag(), coefficients.step));
  return result * hn::BitCast(Tag(), step - hn::ShiftLeft<52>(shift));
}

/// Evaluates polynomials of degree P at the points that are listed for this degree, one SIMD vector of points
/// at a time. The last point of the list is repeated in unused lanes.
template <int P, typename Coefficients, typename Result>
void evaluateListed(const Coefficients& coefficients, const GridFrame& frame, const Batch& batch, Result* out) {
  const Tag d;
  for (std::size_t n = 0; n < batch.listedCount[P - kMinVectorDegree]; n += kLanes) {
    const std::uint32_t* points = batch.listed[P - kMinVectorDegree] + n;
    std::array<const double*, kLanes> leafPoints;
    LaneLeaves leaves;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      leafPoints[lane] = batch.leafPoints[points[lane]].local;
      leaves.offsets[lane] = node::offset(batch.bits[points[lane]]);
    }
    std::array<Lanes, 4> leafPoint;
    std::array<Lanes, coefficientCount(P)> c;
    loadAllTransposed(leafPoints, leafPoint);
    leaves.bits = leafPoint[3];
    loadLeaves<P>(coefficients, leaves, c);
    const auto loaded = asCoefficients<P>(coefficients, c.data());
    const std::array<Lanes, 3> local = {leafPoint[0], leafPoint[1], leafPoint[2]};
    if constexpr (std::is_same_v<Result, double>) {
      HWY_ALIGN double value[kLanes];
      hn::Store(inUnits(coefficients, leaves.bits, evaluatePolynomial(loaded, Constant<P>(), local).v), d, value);
      for (std::size_t lane = 0; lane < kLanes; ++lane) out[points[lane]] = value[lane];
    } else {
      const auto result = evaluatePolynomialWithGradient(loaded, Constant<P>(), local);
      const auto scale = hn::Set(d, 2.0) * depthScale(hn::BitCast(Unsigned(), leaves.bits.v));
      HWY_ALIGN double number[4][kLanes];
      hn::Store(inUnits(coefficients, leaves.bits, result[0].v), d, number[0]);
      for (int axis = 0; axis < 3; ++axis) {
        const auto toWorld = scale * hn::Set(d, frame.cells[axis]) / hn::Set(d, frame.size[axis]);
        hn::Store(inUnits(coefficients, leaves.bits, result[axis + 1].v) * toWorld, d, number[axis + 1]);
      }
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        out[points[lane]] = {number[0][lane], {number[1][lane], number[2][lane], number[3][lane]}};
    }
  }
}

/// A point of a batch that lies in an exact leaf. Points in the same octant of the same leaf have the same key.
struct ExactPoint {
  std::uint64_t key;
  std::uint8_t index;  ///< in the batch
};

/// Packs an exact leaf and an octant. The bits 40 to 42 of a leaf in a lookup grid belong to its depth.
std::uint64_t exactKey(std::uint64_t leaf, int octant) {
  return node::exactLeaf(node::exactSign(leaf), node::offset(leaf)) | std::uint64_t(octant) << 40;
}

/// Evaluates the points that lie in exact leaves. Points in the same octant of a leaf are evaluated together.
template <typename Result>
void evaluateExactPoints(const ExactTriangles& exact, const GridFrame& frame, const Batch& batch,
                         std::span<ExactPoint> exactPoints, Result* out) {
  std::ranges::sort(exactPoints, {}, &ExactPoint::key);
  std::array<Vector3, kBatch> points;
  std::array<Result, kBatch> results;
  for (std::size_t begin = 0, count = 0; begin < exactPoints.size(); begin += count) {
    const std::uint64_t key = exactPoints[begin].key;
    for (count = 0; begin + count < exactPoints.size() && exactPoints[begin + count].key == key; ++count) {
      const std::size_t i = exactPoints[begin + count].index;
      points[count] = worldPoint(frame, {batch.coordinates[0][i], batch.coordinates[1][i], batch.coordinates[2][i]});
    }
    evaluateExact(exact, key, static_cast<int>(key >> 40 & 7), std::span(points).first(count), results.data());
    for (std::size_t n = 0; n < count; ++n) out[exactPoints[begin + n].index] = results[n];
  }
}

/// Evaluates, at each point of a batch, the leaf that holds the point, without blending.
template <typename Coefficients, typename Result>
void evaluateLeaves(const FieldData& field, const Coefficients& coefficients, const GridFrame& frame,
                    const Batch& batch, Result* out) {
  forEachUpTo(Constant<kMaxVectorDegree - kMinVectorDegree>(),
              [&](auto k) { evaluateListed<kMinVectorDegree + k>(coefficients, frame, batch, out); });
  std::array<ExactPoint, kBatch> exactPoints;
  std::size_t exactCount = 0;
  for (std::size_t n = 0; n < batch.listedCount[kLists - 1]; ++n) {
    const std::size_t i = batch.listed[kLists - 1][n];
    const auto& [u, v, w] = batch.leafPoints[i].local;
    if (node::isExact(batch.bits[i])) {
      exactPoints[exactCount++] = {exactKey(batch.bits[i], octantOf({u, v, w})), static_cast<std::uint8_t>(i)};
      continue;
    }
    const LeafPoint leaf{batch.bits[i], LookupGrid::depthOf(batch.bits[i]), {u, v, w}, {}, 0};
    evaluateLeaf(coefficients, frame, leaf, out[i]);
  }
  evaluateExactPoints(field.exact, frame, batch, std::span(exactPoints).first(exactCount), out);
}

/// Returns the i-th point of a batch as a `LeafPoint`. The cell index is not set, because `rampAlong` does not need it.
HWY_INLINE LeafPoint leafPointOf(const Batch& batch, std::size_t i) {
  const auto& local = batch.leafPoints[i].local;
  return {batch.bits[i],
          LookupGrid::depthOf(batch.bits[i]),
          {local[0], local[1], local[2]},
          {},
          batch.blendExtentsIndex[i]};
}

/// Returns the blended field at the i-th point of a batch, from all leaves that have a weight at the point.
template <typename Result>
Result blendAllAt(const FieldData& field, const LookupGrid& lookupGrid, const Batch& batch, std::size_t i) {
  return blendAll<Result>(field, lookupGrid,
                          {batch.coordinates[0][i], batch.coordinates[1][i], batch.coordinates[2][i]},
                          LookupGrid::depthOf(batch.bits[i]));
}

/// The points of a batch at which more than one leaf may have a weight. The constructor collects them without branches.
struct BlendZonePoints {
  std::uint8_t point[kBatch];
  std::uint8_t axes[kBatch];  ///< bit mask of axes from `blendZoneAxes`
  std::size_t count = 0;

  BlendZonePoints(const FieldData& field, const Batch& batch) {
    for (std::size_t i = 0; i < batch.count; ++i) {
      const double* local = batch.leafPoints[i].local;
      point[count] = static_cast<std::uint8_t>(i);
      axes[count] = static_cast<std::uint8_t>(blendZoneAxes(field, {local[0], local[1], local[2]}));
      count += axes[count] != 0;
    }
  }
};

/// A batch of points that are each near one face of their leaf, to be evaluated in the leaf on the other side.
struct AcrossFaces {
  Batch batch;
  std::uint8_t point[kBatch];  ///< index of the point in the original batch
  std::uint8_t axis[kBatch];   ///< axis perpendicular to the face
};

/// Adds point i to `across`. The point is near only one face of its leaf, perpendicular to `axis`. Does nothing
/// if the domain ends at this face.
HWY_INLINE void addAcrossFace(const LookupGrid& lookupGrid, const Batch& batch, std::size_t i, int axis,
                              AcrossFaces& across) {
  const int depth = LookupGrid::depthOf(batch.bits[i]);
  const auto before = static_cast<std::int64_t>(batch.fixedPoint[axis][i]);
  const std::int64_t after =
      fixedPointAcross(before >> (kMaxDepth - depth), depth, batch.leafPoints[i].local[axis] > 0);
  if (after < 0 || after > lookupGrid.frame.last[axis]) return;
  Batch& others = across.batch;
  const std::size_t other = others.count++;
  across.point[other] = static_cast<std::uint8_t>(i);
  across.axis[other] = static_cast<std::uint8_t>(axis);
  for (int a = 0; a < 3; ++a) {
    others.coordinates[a][other] = batch.coordinates[a][i];
    others.fixedPoint[a][other] = batch.fixedPoint[a][i];
  }
  others.fixedPoint[axis][other] = static_cast<double>(after);
  others.path[other] = batch.path[i] ^ pathBits(axis, before) ^ pathBits(axis, after);
  const int shift = kMaxDepth - lookupGrid.depth;
  const std::int64_t stride = axis == 0 ? 1 : axis == 1 ? lookupGrid.row : lookupGrid.slab;
  others.entry[other] = batch.entry[i] + ((after >> shift) - (before >> shift)) * stride;
}

/// Blends the field, like `blendInZone`, at all points of a batch that lie in blend zones. On entry `out` holds
/// the result of each point's own leaf.
template <typename Coefficients, typename Result>
void blend(const FieldData& field, const LookupGrid& lookupGrid, const Coefficients& coefficients, const Batch& batch,
           Result* out) {
  // Blend the points that are near several faces of their leaf one by one. Collect the points that are near a
  // single face.
  const BlendZonePoints points(field, batch);
  AcrossFaces across;
  Batch& others = across.batch;
  others.count = 0;
  for (std::size_t n = 0; n < points.count; ++n) {
    const std::size_t i = points.point[n];
    if (std::has_single_bit(points.axes[n]))
      addAcrossFace(lookupGrid, batch, i, std::countr_zero(points.axes[n]), across);
    else
      out[i] = blendAllAt<Result>(field, lookupGrid, batch, i);
  }
  if (others.count == 0) return;

  // Evaluate the collected points in the leaves on the other side of the faces.
  descend<true>(field, lookupGrid, others);
  listByDegree(coefficients, others);
  enterLeaves(others);
  Result acrossResults[kBatch];
  evaluateLeaves(field, coefficients, lookupGrid.frame, others, acrossResults);

  // Blend the two leaves of each collected point, or all leaves if a third one also has a weight at the point.
  for (std::size_t other = 0; other < others.count; ++other) {
    const std::size_t i = across.point[other];
    const int axis = across.axis[other];
    const LeafPoint a = leafPointOf(batch, i), b = leafPointOf(others, other);
    if (!onlyTwoOverlap(field, b.local, axis)) {
      out[i] = blendAllAt<Result>(field, lookupGrid, batch, i);
      continue;
    }
    out[i] = blendTwo(out[i], rampAlong(field, lookupGrid, a, axis), acrossResults[other],
                      rampAlong(field, lookupGrid, b, axis), axis);
  }
}

template <typename Result>
void continueAllOutside(const GridFrame& frame, const Batch& batch, Result* out) {
  if (batch.allInDomain) return;
  for (std::size_t i = 0; i < batch.count; ++i)
    if (!contains(frame, batch.points[i]))
      continueOutside(batch.points[i] - closestInDomain(frame, batch.points[i]), out[i]);
}

template <typename Result>
void evaluateAll(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
                 std::span<Result> out) {
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
          listByDegree(c, batch);
          enterLeaves(batch);
          evaluateLeaves(field, c, lookupGrid.frame, batch, out.data() + first);
          if (field.blend > 0) blend(field, lookupGrid, c, batch, out.data() + first);
          continueAllOutside(lookupGrid.frame, batch, out.data() + first);
        },
        field.coefficients);
  }
}

void values(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
            std::span<double> out) {
  evaluateAll(field, lookupGrid, points, out);
}

void valuesAndGradients(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
                        std::span<ValueAndGradient> out) {
  evaluateAll(field, lookupGrid, points, out);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace hpsdf::query
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hpsdf::query {

HWY_EXPORT(values);
HWY_EXPORT(valuesAndGradients);

void evaluateBatch(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
                   std::span<double> out) {
  HWY_DYNAMIC_DISPATCH(values)(field, lookupGrid, points, out);
}

void evaluateBatch(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
                   std::span<ValueAndGradient> out) {
  HWY_DYNAMIC_DISPATCH(valuesAndGradients)(field, lookupGrid, points, out);
}

}  // namespace hpsdf::query
#endif
