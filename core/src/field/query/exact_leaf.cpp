#include "field/query/exact_leaf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <variant>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "field/query/exact_leaf.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include to follow foreach_target.h.
#include <hwy/highway.h>

#ifndef HPSDF_EXACT_LEAF_CHUNK
#define HPSDF_EXACT_LEAF_CHUNK
namespace hpsdf::query {

/// Some triangles of a list, in single precision relative to a query point, and bounds of their distances from it.
struct Chunk {
  static constexpr std::size_t kSize = 64;

  std::size_t count = 0;
  std::array<std::uint32_t, kSize> triangle;
  alignas(64) float corner[9][kSize];  ///< x, y and z of the corners A, B and C, minus the query point
  alignas(64) float lower[kSize];      ///< lower bound of the distance, or NaN for a triangle without area
  alignas(64) float upper[kSize];      ///< upper bound of the distance, or NaN for a triangle without area
};

}  // namespace hpsdf::query
#endif

HWY_BEFORE_NAMESPACE();
namespace hpsdf::query {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, 16>;
using Vec = hn::Vec<Tag>;
constexpr std::size_t kLanes = hn::MaxLanes(Tag());
static_assert(Chunk::kSize % kLanes == 0);

struct Vec3 {
  Vec x, y, z;
  friend HWY_INLINE Vec3 operator-(const Vec3& a, const Vec3& b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
  }
};

HWY_INLINE Vec dot(const Vec3& a, const Vec3& b) {
  return hn::MulAdd(a.z, b.z, hn::MulAdd(a.y, b.y, hn::Mul(a.x, b.x)));
}
HWY_INLINE Vec3 cross(const Vec3& a, const Vec3& b) {
  return {hn::NegMulAdd(a.z, b.y, hn::Mul(a.y, b.z)), hn::NegMulAdd(a.x, b.z, hn::Mul(a.z, b.x)),
          hn::NegMulAdd(a.y, b.x, hn::Mul(a.x, b.y))};
}

/// Returns the squared distance from the origin to the segment that begins at `from` with the direction `along`.
HWY_INLINE Vec squaredToSegment(const Vec3& from, const Vec3& along, Vec squaredLength) {
  const Tag d;
  const Vec t = hn::Min(hn::Max(hn::Div(hn::Neg(dot(from, along)), squaredLength), hn::Zero(d)), hn::Set(d, 1.0F));
  const Vec3 to = {hn::MulAdd(t, along.x, from.x), hn::MulAdd(t, along.y, from.y), hn::MulAdd(t, along.z, from.z)};
  return dot(to, to);
}

/// Computes bounds of the distances from the origin to the triangles of a chunk. The error of a computed distance is
/// bounded by a multiple of the distance R to the farthest corner; for a triangle of little height, whose normal is less
/// accurate, the multiple is greater.
void findBounds(Chunk& chunk) {
  const Tag d;
  constexpr float kRounding = 32 * std::numeric_limits<float>::epsilon();
  for (std::size_t i = 0; i < chunk.count; i += kLanes) {
    const auto load = [&](int corner) HWY_ATTR {
      return Vec3{hn::Load(d, chunk.corner[3 * corner] + i), hn::Load(d, chunk.corner[3 * corner + 1] + i),
                  hn::Load(d, chunk.corner[3 * corner + 2] + i)};
    };
    const Vec3 a = load(0), b = load(1), c = load(2);
    const Vec3 ab = b - a, bc = c - b, ca = a - c;
    const Vec3 n = cross(ab, bc);
    const Vec nn = dot(n, n), abab = dot(ab, ab), bcbc = dot(bc, bc), caca = dot(ca, ca);
    const auto outside = [&](const Vec3& corner, const Vec3& side)
                             HWY_ATTR { return dot(n, cross(corner, side)) < hn::Zero(d); };
    const auto isOutside = hn::Or(hn::Or(outside(a, ab), outside(b, bc)), outside(c, ca));
    const Vec height = dot(n, a);
    const Vec toPlane = hn::Div(hn::Mul(height, height), nn);
    const Vec toSides = hn::Min(hn::Min(squaredToSegment(a, ab, abab), squaredToSegment(b, bc, bcbc)),
                                squaredToSegment(c, ca, caca));
    const Vec distance = hn::Sqrt(hn::IfThenElse(isOutside, toSides, toPlane));
    const Vec farthest = hn::Sqrt(hn::Max(hn::Max(dot(a, a), dot(b, b)), dot(c, c)));
    const Vec longest = hn::Max(hn::Max(abab, bcbc), caca);
    const Vec error = hn::Mul(hn::Mul(hn::Set(d, kRounding), farthest), hn::Div(longest, hn::Sqrt(nn)));
    hn::Store(hn::Sub(distance, error), d, chunk.lower + i);
    hn::Store(hn::Add(distance, error), d, chunk.upper + i);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace hpsdf::query
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hpsdf::query {
namespace {

HWY_EXPORT(findBounds);

/// The nearest feature (face, edge or vertex) of a list of triangles.
struct NearestFeature {
  double squared = std::numeric_limits<double>::infinity();
  Vector3 difference = Vector3::Zero();  ///< from the closest point to the query point
  Vector3 normal = Vector3::Zero();      ///< for a face: its normal, not normalized
  double height = 0;                     ///< for a face: signed distance from its plane
  std::uint32_t corners = 0;             ///< number of corners of the feature: 1, 2 or 3
  std::array<std::uint32_t, 2> vertex{};  ///< for an edge or a vertex: its vertices, the lower index first
};

/// Evaluates the exact leaf's list at one point.
template <typename V>
class ListSearch {
 public:
  ListSearch(const ExactTriangles& exact, const std::vector<V>& vertices, std::uint64_t leaf, const Vector3& x)
      : exact_(exact), vertices_(vertices.data()), list_(&exact.lists[node::offset(leaf)]), x_(x) {}

  NearestFeature nearest() {
    Chunk chunk;
    forEachTriangle([&](std::uint32_t triangle) {
      if (chunk.count == Chunk::kSize) search(chunk);
      add(triangle, chunk);
    });
    search(chunk);
    return best_;
  }

  /// Returns the pseudonormal of the nearest feature, not normalized.
  Vector3 pseudonormal(const NearestFeature& feature) const {
    if (feature.corners == 3) return feature.normal;
    Vector3 sum = Vector3::Zero();
    forEachTriangle([&](std::uint32_t triangle) {
      const auto& corners = exact_.triangles[triangle];
      int at = -1;
      for (int k = 0; k < 3; ++k)
        if (corners[k] == feature.vertex[0]) at = k;
      if (at < 0) return;
      const Vector3 origin = vertex(corners[at]);
      const Vector3 next = vertex(corners[(at + 1) % 3]) - origin, previous = vertex(corners[(at + 2) % 3]) - origin;
      const Vector3 normal = next.cross(previous);
      const double length = normal.norm();
      if (!(length > 0)) return;
      if (feature.corners == 1)
        sum += std::atan2(length, next.dot(previous)) / length * normal;
      else if (corners[(at + 1) % 3] == feature.vertex[1] || corners[(at + 2) % 3] == feature.vertex[1])
        sum += normal / length;
    });
    return sum;
  }

 private:
  Vector3 vertex(std::uint32_t index) const { return vertices_[index].template cast<double>(); }

  template <typename F>
  void forEachTriangle(const F& f) const {
    for (const std::uint32_t* run = list_;; ++run) {
      const std::uint32_t first = triangle_run::first(*run), end = first + triangle_run::length(*run);
      for (std::uint32_t triangle = first; triangle < end; ++triangle) f(triangle);
      if (triangle_run::isLast(*run)) return;
    }
  }

  void add(std::uint32_t triangle, Chunk& chunk) const {
    const std::size_t at = chunk.count++;
    chunk.triangle[at] = triangle;
    for (int corner = 0; corner < 3; ++corner) {
      const Vector3 relative = vertex(exact_.triangles[triangle][corner]) - x_;
      for (int axis = 0; axis < 3; ++axis) chunk.corner[3 * corner + axis][at] = static_cast<float>(relative[axis]);
    }
  }

  /// Finds the nearest triangle of a chunk in double precision, among those that single precision cannot exclude.
  /// Empties the chunk.
  void search(Chunk& chunk) {
    constexpr std::size_t kFew = 3;  // so few triangles are tried at once
    if (chunk.count <= kFew) {
      for (std::size_t i = 0; i < chunk.count; ++i) tryTriangle(chunk.triangle[i]);
    } else {
      constexpr std::size_t kMostLanes = 16;
      for (std::size_t i = chunk.count; i % kMostLanes != 0; ++i)
        for (auto& coordinate : chunk.corner) coordinate[i] = coordinate[chunk.count - 1];
      HWY_DYNAMIC_DISPATCH(findBounds)(chunk);
      for (std::size_t i = 0; i < chunk.count; ++i)
        if (chunk.upper[i] < limit_) limit_ = chunk.upper[i];
      for (std::size_t i = 0; i < chunk.count; ++i)
        if (!(chunk.lower[i] > limit_)) tryTriangle(chunk.triangle[i]);
    }
    chunk.count = 0;
  }

  void tryTriangle(std::uint32_t triangle) {
    const auto& corners = exact_.triangles[triangle];
    const std::array<Vector3, 3> v = {vertex(corners[0]), vertex(corners[1]), vertex(corners[2])};
    const Vector3 normal = (v[1] - v[0]).cross(v[2] - v[0]);
    const double squaredNormal = normal.squaredNorm();
    bool inside = squaredNormal > 0;
    for (int k = 0; k < 3; ++k) {
      const Vector3 side = v[(k + 1) % 3] - v[k];
      if (squaredNormal > 0 && normal.dot(side.cross(x_ - v[k])) > 0) continue;
      inside = false;
      trySide(corners[k], corners[(k + 1) % 3]);
    }
    if (inside) tryFace(normal, squaredNormal, x_ - v[0]);
  }

  void tryFace(const Vector3& normal, double squaredNormal, const Vector3& fromCorner) {
    const double along = fromCorner.dot(normal);  // height times the length of the normal
    const double squared = along * along / squaredNormal;
    if (squared >= best_.squared) return;
    best_ = {squared, normal * (along / squaredNormal), normal, along / std::sqrt(squaredNormal), 3, {}};
  }

  /// Tries the side of a triangle. Its ends are ordered by index, so that the triangles at an edge give the same result.
  void trySide(std::uint32_t from, std::uint32_t to) {
    if (from > to) std::swap(from, to);
    const Vector3 start = vertex(from), along = vertex(to) - start, difference = x_ - start;
    const double t = difference.dot(along), squaredLength = along.squaredNorm();
    if (t <= 0) return tryPoint(difference, 1, {from, from});
    if (t >= squaredLength) return tryPoint(x_ - vertex(to), 1, {to, to});
    tryPoint(difference - along * (t / squaredLength), 2, {from, to});
  }

  void tryPoint(const Vector3& difference, std::uint32_t corners, const std::array<std::uint32_t, 2>& vertices) {
    const double squared = difference.squaredNorm();
    if (squared < best_.squared) best_ = {squared, difference, Vector3::Zero(), 0, corners, vertices};
  }

  const ExactTriangles& exact_;
  const V* vertices_;
  const std::uint32_t* list_;
  Vector3 x_;
  NearestFeature best_;
  float limit_ = std::numeric_limits<float>::infinity();  ///< upper bound of the distance to the nearest triangle
};

/// Returns 1 if the signed distance grows along the normal of the nearest face, and -1 if it falls.
double slopeAcross(const NearestFeature& face, ExactSign sign) {
  if (sign == ExactSign::pseudonormal) return 1;
  return (face.height < 0) == (sign == ExactSign::negative) ? 1 : -1;
}

/// The signed distance to a list, before the offset is subtracted, with its gradient.
template <typename V>
ValueAndGradient signedDistance(const ExactTriangles& exact, const std::vector<V>& vertices, std::uint64_t leaf,
                                const Vector3& x, bool withGradient) {
  ListSearch<V> search(exact, vertices, leaf, x);
  const NearestFeature nearest = search.nearest();
  const ExactSign sign = node::exactSign(leaf);
  const double distance = std::sqrt(nearest.squared);
  ValueAndGradient result{distance, Vector3::Zero()};
  const bool needsNormal = sign == ExactSign::pseudonormal || (withGradient && !(distance > 0));
  const Vector3 normal = needsNormal ? search.pseudonormal(nearest) : Vector3::Zero();
  if (sign == ExactSign::pseudonormal) {
    if (nearest.corners == 3)
      result.value = nearest.height + 0.0;
    else if (nearest.difference.dot(normal) < 0)
      result.value = -distance;
  } else if (sign == ExactSign::negative) {
    result.value = -distance;
  }
  if (withGradient) {
    if (nearest.corners == 3)
      result.gradient = nearest.normal.normalized() * slopeAcross(nearest, sign);
    else
      result.gradient = distance > 0 ? Vector3(nearest.difference / result.value) : Vector3(normal.normalized());
  }
  return result;
}

template <typename V>
ValueAndGradient evaluated(const ExactTriangles& exact, const std::vector<V>& vertices, std::uint64_t leaf,
                           const Vector3& x, bool withGradient) {
  ValueAndGradient result = signedDistance(exact, vertices, leaf, x, withGradient);
  result.value -= exact.offset;
  return result;
}

}  // namespace

void evaluateExact(const ExactTriangles& exact, std::uint64_t leaf, const Vector3& x, double& value) {
  value = std::visit([&](const auto& v) { return evaluated(exact, v, leaf, x, false).value; }, exact.vertices);
}

void evaluateExact(const ExactTriangles& exact, std::uint64_t leaf, const Vector3& x, ValueAndGradient& result) {
  result = std::visit([&](const auto& v) { return evaluated(exact, v, leaf, x, true); }, exact.vertices);
}

}  // namespace hpsdf::query
#endif
