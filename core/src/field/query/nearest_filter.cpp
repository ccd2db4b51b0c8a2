#include "field/query/nearest_filter.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "field/query/nearest_filter.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include to follow foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hpsdf::query {
namespace HWY_NAMESPACE {
namespace {

#include "mesh/triangle_bounds-inl.h"

#if HWY_TARGET == HWY_SCALAR

/// Loads three floats from each of the places, as many as a vector has lanes.
HWY_INLINE Vec3 loadTransposed(const float* const* places) {
  return broadcast(Eigen::Map<const Eigen::Vector3f>(places[0]));
}

#else

/// Loads four floats from p[0], p[4], p[8] and p[12], as far as the vector reaches.
template <class D>
HWY_INLINE hn::Vec<D> loadBlocks(D d, const float* const* p) {
  if constexpr (hn::MaxLanes(D()) <= 4) {
    return hn::LoadU(d, p[0]);
  } else {
    const hn::Half<D> half;
    return hn::Combine(d, loadBlocks(half, p + hn::MaxLanes(D()) / 2), loadBlocks(half, p));
  }
}

/// Loads three floats from each of the places, as many as a vector has lanes. A fourth one is read at each place and
/// does not matter.
HWY_INLINE Vec3 loadTransposed(const float* const* places) {
  const Tag d;
  const Vec v0 = loadBlocks(d, places), v1 = loadBlocks(d, places + 1), v2 = loadBlocks(d, places + 2),
            v3 = loadBlocks(d, places + 3);
  const Vec low02 = hn::InterleaveLower(d, v0, v2), low13 = hn::InterleaveLower(d, v1, v3);
  const Vec high02 = hn::InterleaveUpper(d, v0, v2), high13 = hn::InterleaveUpper(d, v1, v3);
  return {hn::InterleaveLower(d, low02, low13), hn::InterleaveUpper(d, low02, low13),
          hn::InterleaveLower(d, high02, high13)};
}

#endif

/// Returns a number without the last 29 of its 52 binary digits, which is a float.
HWY_INLINE double leadingDigits(double number) {
  constexpr std::uint64_t kLast = (std::uint64_t{1} << 29) - 1;
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(number) & ~kLast);
}

/// Loads the corners of triangles relative to the origin of the source.
template <typename V>
class CornerLoader;

template <>
class CornerLoader<Eigen::Vector3f> {
 public:
  explicit CornerLoader(const CornerSource<Eigen::Vector3f>& source)
      : triangles_(source.triangles.data()),
        vertices_(source.vertices.data()->data()),
        last_(source.vertices.size() - 1) {
    Eigen::Vector3f high, low;
    for (int axis = 0; axis < 3; ++axis) {
      const double leading = leadingDigits(source.origin[axis]);
      high[axis] = static_cast<float>(leading);
      low[axis] = static_cast<float>(source.origin[axis] - leading);
    }
    high_ = broadcast(high);
    low_ = broadcast(low);
    std::copy_n(source.vertices[last_].data(), 3, copyOfLast_);
  }

  /// Sets the corners of as many triangles as a vector has lanes.
  HWY_INLINE void load(const std::uint32_t* triangles, Vec3 (&corners)[3]) const {
    const float* places[3][kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      for (int k = 0; k < 3; ++k) {
        const std::size_t index = triangles_[triangles[lane]][k];
        places[k][lane] = index < last_ ? vertices_ + 3 * index : copyOfLast_;
      }
    // The subtraction in two parts keeps the relative error small.
    for (int k = 0; k < 3; ++k) corners[k] = minus(minus(loadTransposed(places[k]), high_), low_);
  }

 private:
  const std::array<std::uint32_t, 3>* triangles_;
  const float* vertices_;
  std::size_t last_;          ///< index of the last vertex, behind which nothing can be read
  float copyOfLast_[4] = {};  ///< its coordinates, and one more number
  Vec3 high_, low_;           ///< their sum is the origin
};

template <>
class CornerLoader<Eigen::Vector3d> {
 public:
  explicit CornerLoader(const CornerSource<Eigen::Vector3d>& source) : source_(source) {}

  HWY_INLINE void load(const std::uint32_t* triangles, Vec3 (&corners)[3]) const {
    const Tag d;
    HWY_ALIGN float relative[3][kLanes];
    for (int k = 0; k < 3; ++k) {
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const Vector3& vertex = source_.vertices[source_.triangles[triangles[lane]][k]];
        for (int axis = 0; axis < 3; ++axis)
          relative[axis][lane] = static_cast<float>(vertex[axis] - source_.origin[axis]);
      }
      corners[k] = {hn::Load(d, relative[0]), hn::Load(d, relative[1]), hn::Load(d, relative[2])};
    }
  }

 private:
  const CornerSource<Eigen::Vector3d>& source_;
};

/// Fills the vector that contains the last triangle with copies of it.
HWY_INLINE void fillLast(std::uint32_t* triangles, std::uint32_t count) {
  const hn::RebindToUnsigned<Tag> d;
  hn::StoreU(hn::Set(d, triangles[count - 1]), d, triangles + count);
}

/// Writes the triangles of the first runs, as many as fit into a chunk. Returns their number. A run is written as if
/// it had the greatest length, because the end of a loop up to its length would often be mispredicted.
HWY_INLINE std::uint32_t expandRuns(const std::uint32_t*& run, std::uint32_t* triangles) {
  const hn::RebindToUnsigned<Tag> d;
  const auto steps = hn::Iota(d, 0);
  std::uint32_t count = 0;
  for (; run != nullptr; run = triangle_run::isLast(*run) ? nullptr : run + 1) {
    const std::uint32_t length = triangle_run::length(*run);
    if (count + length > mesh::TriangleChunk::kSize) break;
    for (std::uint32_t i = 0; i < triangle_run::kMostLength; i += kLanes)
      hn::StoreU(hn::Add(hn::Set(d, triangle_run::first(*run) + i), steps), d, triangles + count + i);
    count += length;
  }
  return count;
}

/// Keeps the triangles that matter in an octant. Returns their number.
HWY_INLINE std::uint32_t keepInOctant(std::span<const std::uint8_t> octants, int octant, std::uint32_t* triangles,
                                      std::uint32_t count) {
  using Bytes = hn::CappedTag<std::uint8_t, 64>;
  constexpr std::size_t kBytes = hn::MaxLanes(Bytes());
  const Bytes d;
  const auto bit = hn::Set(d, static_cast<std::uint8_t>(1U << octant));
  HWY_ALIGN std::uint8_t copy[mesh::TriangleChunk::kSize + kBytes];
  const std::uint8_t* from = octants.data();
  if (octants.size() < count + kBytes) [[unlikely]]  // a load of whole vectors could pass the end
    from = (std::copy_n(from, count, copy), copy);
  std::uint32_t kept = 0;
  for (std::uint32_t first = 0; first < count; first += kBytes) {
    std::uint64_t bits = 0;
    hn::StoreMaskBits(d, hn::TestBit(hn::LoadU(d, from + first), bit), reinterpret_cast<std::uint8_t*>(&bits));
    const std::uint32_t rest = count - first;
    if (rest < 64) bits &= (std::uint64_t{1} << rest) - 1;
    for (; bits != 0; bits &= bits - 1)
      triangles[kept++] = triangles[first + static_cast<std::uint32_t>(std::countr_zero(bits))];
  }
  return kept;
}

template <typename V>
HWY_INLINE std::uint32_t keepNearestIn(const CornerSource<V>& source, ListPart& rest, int octant, float radius,
                                       std::uint32_t* triangles, float& nearest) {
  constexpr std::uint32_t kFew = 3;  // bounds of so few triangles take longer than their distances
  constexpr float kRounding = 1 + 1e-6F;
  const std::uint32_t expanded = expandRuns(rest.run, triangles);
  std::uint32_t count = keepInOctant(rest.octants, octant, triangles, expanded);
  rest.octants = rest.octants.subspan(expanded);
  if (count <= kFew) return count;
  const Tag d;
  fillLast(triangles, count);
  const CornerLoader<V> loader(source);
  HWY_ALIGN float lowerBounds[mesh::TriangleChunk::kSize];
  Vec least = hn::Set(d, nearest);
  for (std::uint32_t i = 0; i < count; i += kLanes) {
    Vec3 corners[3];
    loader.load(triangles + i, corners);
    const auto [lower, upper] = boundsOf(corners[0], corners[1], corners[2], hn::Zero(d));
    hn::Store(lower, d, lowerBounds + i);
    least = hn::IfThenElse(hn::Lt(upper, least), upper, least);
  }
  nearest = hn::GetLane(hn::MinOfLanes(d, least));
  // No triangle farther from the centre of a ball than d + 2r can be nearest to one of its points, where d is the
  // distance of the triangle that is nearest to the centre.
  const Vec limit = hn::Set(d, (nearest + 2 * radius) * kRounding);
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < count; i += kLanes) {
    std::uint64_t far = 0;
    const auto isFar = hn::Gt(hn::Load(d, lowerBounds + i), limit);  // false for a triangle without area
    hn::StoreMaskBits(d, isFar, reinterpret_cast<std::uint8_t*>(&far));
    std::uint64_t near = ~far & ((std::uint64_t{1} << std::min<std::uint32_t>(kLanes, count - i)) - 1);
    for (; near != 0; near &= near - 1)
      triangles[kept++] = triangles[i + static_cast<std::uint32_t>(std::countr_zero(near))];
  }
  return kept;
}

template <typename V>
HWY_INLINE void loadCornersFrom(const CornerSource<V>& source, std::uint32_t* triangles, std::uint32_t count,
                                mesh::TriangleChunk& chunk) {
  const Tag d;
  fillLast(triangles, count);
  const CornerLoader<V> loader(source);
  chunk.count = count;
  for (std::uint32_t i = 0; i < count; i += kLanes) {
    Vec3 corners[3];
    loader.load(triangles + i, corners);
    for (int k = 0; k < 3; ++k) {
      hn::Store(corners[k].x, d, &chunk.corners[k][0][i]);
      hn::Store(corners[k].y, d, &chunk.corners[k][1][i]);
      hn::Store(corners[k].z, d, &chunk.corners[k][2][i]);
    }
  }
}

std::uint32_t keepNearestOfFloats(const CornerSource<Eigen::Vector3f>& source, ListPart& rest, int octant, float radius,
                                  std::uint32_t* triangles, float& nearest) {
  return keepNearestIn(source, rest, octant, radius, triangles, nearest);
}

std::uint32_t keepNearestOfDoubles(const CornerSource<Eigen::Vector3d>& source, ListPart& rest, int octant,
                                   float radius, std::uint32_t* triangles, float& nearest) {
  return keepNearestIn(source, rest, octant, radius, triangles, nearest);
}

void loadFloats(const CornerSource<Eigen::Vector3f>& source, std::uint32_t* triangles, std::uint32_t count,
                mesh::TriangleChunk& chunk) {
  loadCornersFrom(source, triangles, count, chunk);
}

void loadDoubles(const CornerSource<Eigen::Vector3d>& source, std::uint32_t* triangles, std::uint32_t count,
                 mesh::TriangleChunk& chunk) {
  loadCornersFrom(source, triangles, count, chunk);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace hpsdf::query
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hpsdf::query {

HWY_EXPORT(keepNearestOfFloats);
HWY_EXPORT(keepNearestOfDoubles);
HWY_EXPORT(loadFloats);
HWY_EXPORT(loadDoubles);

std::uint32_t keepNearest(const CornerSource<Eigen::Vector3f>& source, ListPart& rest, int octant, float radius,
                          std::uint32_t* triangles, float& nearest) {
  return HWY_DYNAMIC_DISPATCH(keepNearestOfFloats)(source, rest, octant, radius, triangles, nearest);
}

std::uint32_t keepNearest(const CornerSource<Eigen::Vector3d>& source, ListPart& rest, int octant, float radius,
                          std::uint32_t* triangles, float& nearest) {
  return HWY_DYNAMIC_DISPATCH(keepNearestOfDoubles)(source, rest, octant, radius, triangles, nearest);
}

void loadCorners(const CornerSource<Eigen::Vector3f>& source, std::uint32_t* triangles, std::uint32_t count,
                 mesh::TriangleChunk& chunk) {
  HWY_DYNAMIC_DISPATCH(loadFloats)(source, triangles, count, chunk);
}

void loadCorners(const CornerSource<Eigen::Vector3d>& source, std::uint32_t* triangles, std::uint32_t count,
                 mesh::TriangleChunk& chunk) {
  HWY_DYNAMIC_DISPATCH(loadDoubles)(source, triangles, count, chunk);
}

}  // namespace hpsdf::query
#endif
