#include "field/query/exact_leaf.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>
#include <variant>

#include "field/query/octant_filter.h"
#include "hpsdf/detail/exact_sign.h"
#include "hpsdf/detail/triangle_list.h"
#include "mesh/triangle_bounds.h"

namespace hpsdf::query {
namespace {

using mesh::TriangleChunk;

/// Returns a number without the last 29 of its 52 binary digits, which is a float.
double leadingDigits(double number) {
  constexpr std::uint64_t kLast = (std::uint64_t{1} << 29) - 1;
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(number) & ~kLast);
}

/// The nearest feature (face, edge or vertex) of a list of triangles.
struct NearestFeature {
  double squared = std::numeric_limits<double>::infinity();
  Vector3 difference = Vector3::Zero();   ///< from the closest point to the query point
  Vector3 normal = Vector3::Zero();       ///< for a face: its normal, not normalized
  double height = 0;                      ///< for a face: signed distance from its plane
  std::uint32_t corners = 0;              ///< number of corners of the feature: 1, 2 or 3
  std::array<std::uint32_t, 2> vertex{};  ///< for an edge or a vertex: its vertices, the lower index first
};

/// Triangles of a chunk, with room for those that are stored at once beyond its end.
using Triangles = std::array<std::uint32_t, TriangleChunk::kSize + std::max(triangle_run::kMostLength, kFilterWidth)>;

/// Finds the feature that is nearest to a point, in double precision.
template <typename V>
class FeatureSearch {
 public:
  FeatureSearch(const ExactTriangles& exact, const std::vector<V>& vertices, const Vector3& x)
      : triangles_(exact.triangles.data()), vertices_(vertices.data()), x_(x) {}

  const NearestFeature& best() const { return best_; }

  void tryTriangle(std::uint32_t triangle) {
    const auto& corners = triangles_[triangle];
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

 private:
  Vector3 vertex(std::uint32_t index) const { return vertices_[index].template cast<double>(); }

  void tryFace(const Vector3& normal, double squaredNormal, const Vector3& fromCorner) {
    const double along = fromCorner.dot(normal);  // height times the length of the normal
    const double squared = along * along / squaredNormal;
    if (squared >= best_.squared) return;
    best_ = {squared, normal * (along / squaredNormal), normal, along / std::sqrt(squaredNormal), 3, {}};
  }

  /// Tries the side of a triangle. Its ends are ordered by index, so that the triangles at an edge give the same
  /// result.
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

  const std::array<std::uint32_t, 3>* triangles_;
  const V* vertices_;
  Vector3 x_;
  NearestFeature best_;
};

/// Loads the corners of triangles relative to a point, in single precision.
template <typename V>
class CornerLoader {
 public:
  CornerLoader(const ExactTriangles& exact, const std::vector<V>& vertices, const Vector3& origin)
      : triangles_(exact.triangles.data()), vertices_(vertices.data()), last_(vertices.size() - 1), origin_(origin) {
    for (int axis = 0; axis < 3; ++axis) {
      const double high = leadingDigits(origin[axis]);
      high_[axis] = static_cast<float>(high);
      low_[axis] = static_cast<float>(origin[axis] - high);
    }
  }

  void load(const Triangles& triangles, std::uint32_t count, TriangleChunk& chunk) const {
    chunk.count = count;
    for (std::uint32_t i = 0; i < count; ++i)
      for (int k = 0; k < 3; ++k) setRelative(triangles_[triangles[i]][k], chunk.corners[k][i]);
    fillLastVector(chunk);
  }

 private:
  /// Sets `out` to a vertex minus the origin.
  void setRelative(std::uint32_t index, Eigen::Vector4f& out) const {
    const V& vertex = vertices_[index];
    if constexpr (std::is_same_v<V, Eigen::Vector3f>) {
      // The subtraction in two parts keeps the relative error small. A load of four floats is much faster than three
      // loads of one; the fourth belongs to the next vertex and does not matter.
      if (index < last_) [[likely]]
        out = (Eigen::Map<const Eigen::Vector4f>(vertex.data()) - high_) - low_;
      else
        out.head<3>() = (vertex - high_.head<3>()) - low_.head<3>();
    } else {
      for (int axis = 0; axis < 3; ++axis) out[axis] = static_cast<float>(vertex[axis] - origin_[axis]);
    }
  }

  const std::array<std::uint32_t, 3>* triangles_;
  const V* vertices_;
  std::size_t last_;  ///< index of the last vertex
  Vector3 origin_;
  Eigen::Vector4f high_ = Eigen::Vector4f::Zero(), low_ = Eigen::Vector4f::Zero();  ///< sum of two floats: the origin
};

/// Keeps the items for which `keep` is true, without branches that could be mispredicted. Returns their number.
template <typename Keep>
std::uint32_t keepOnly(Triangles& triangles, std::uint32_t count, const Keep& keep) {
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    triangles[kept] = triangles[i];
    kept += static_cast<std::uint32_t>(keep(i));
  }
  return kept;
}

float leastUpperBound(const TriangleChunk& chunk) {
  float least = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < chunk.count; ++i) least = chunk.upper[i] < least ? chunk.upper[i] : least;
  return least;
}

/// The triangles that matter in one octant of an exact leaf.
template <typename V>
class OctantTriangles {
 public:
  OctantTriangles(const ExactTriangles& exact, const std::vector<V>& vertices, std::uint64_t leaf, int octant)
      : exact_(exact), vertices_(vertices), leaf_(leaf), octant_(octant) {}

  NearestFeature nearestTo(const Vector3& x) const {
    FeatureSearch<V> search(exact_, vertices_, x);
    float limit = std::numeric_limits<float>::infinity();
    forEachChunk([&](Triangles& triangles, std::uint32_t count) {
      if (count > kFew) {
        TriangleChunk chunk;
        CornerLoader(exact_, vertices_, x).load(triangles, count, chunk);
        findBounds(chunk);
        limit = std::min(limit, leastUpperBound(chunk));
        count = keepOnly(triangles, count, [&](std::uint32_t i) { return !(chunk.lower[i] > limit); });
      }
      for (std::uint32_t i = 0; i < count; ++i) search.tryTriangle(triangles[i]);
    });
    return search.best();
  }

  /// Calls f(i, feature) with the feature that is nearest to the i-th of several points. The results are those of
  /// single queries, but come faster, because the points share the work of loading triangles.
  template <typename F>
  void forEachNearest(std::span<const Vector3> points, const F& f) const {
    if (points.size() == 1 || TriangleListView(exact_, leaf_).count() > TriangleChunk::kSize) {
      for (std::size_t i = 0; i < points.size(); ++i) f(i, nearestTo(points[i]));
      return;
    }
    forEachChunk([&](Triangles& triangles, std::uint32_t count) {
      Box box;
      for (const Vector3& x : points) box.extend(x);
      const Vector3 origin = box.center();
      TriangleChunk chunk;
      CornerLoader(exact_, vertices_, origin).load(triangles, count, chunk);
      if (count > kFew) keepNearestToBall(static_cast<float>(box.sizes().norm() / 2), triangles, chunk);
      for (std::size_t i = 0; i < points.size(); ++i) {
        FeatureSearch<V> search(exact_, vertices_, points[i]);
        const bool hasBounds = chunk.count > kFew;
        if (hasBounds) findBounds(chunk, (points[i] - origin).template cast<float>());
        const float limit = hasBounds ? leastUpperBound(chunk) : 0;
        for (std::uint32_t n = 0; n < chunk.count; ++n)
          if (!hasBounds || !(chunk.lower[n] > limit)) search.tryTriangle(triangles[n]);
        f(i, search.best());
      }
    });
  }

  /// Returns the pseudonormal of the nearest feature, not normalized.
  Vector3 pseudonormal(const NearestFeature& feature) const {
    if (feature.corners == 3) return feature.normal;
    const auto vertex = [&](std::uint32_t index) { return Vector3(vertices_[index].template cast<double>()); };
    Vector3 sum = Vector3::Zero();
    forEachTriangle(exact_, leaf_, [&](std::uint32_t triangle) {
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

  /// Returns 1 if the signed distance grows at a point along the normal of its nearest face, and -1 if it falls. `sign`
  /// is that of `signAt`.
  double slopeAcross(const NearestFeature& face, const Vector3& x, ExactSign sign) const {
    if (sign == ExactSign::pseudonormal) return 1;
    if (node::exactSign(leaf_) == ExactSign::winding) [[unlikely]]
      return slopeByWinding(exact_, leaf_, x, face.normal.normalized(), face.height);
    return (face.height < 0) == (sign == ExactSign::negative) ? 1 : -1;
  }

  /// Returns how the distance gets its sign at a point: by the pseudonormal, or positive or negative.
  ExactSign signAt(const Vector3& x) const {
    const ExactSign rule = node::exactSign(leaf_);
    if (rule != ExactSign::winding) [[likely]]
      return rule;
    return windingAt(exact_, leaf_, x) > 0 ? ExactSign::negative : ExactSign::positive;
  }

  double offset() const { return exact_.offset; }

 private:
  static constexpr std::uint32_t kFew = 3;  ///< so few triangles are tried without bounds

  /// Calls f(triangles, count) with the triangles in the octant, up to the size of a chunk at a time. `f` may change
  /// the triangles.
  template <typename F>
  void forEachChunk(const F& f) const {
    constexpr std::uint32_t kAtOnce = 8;  // so many triangles are stored without a branch that could be mispredicted
    const TriangleListView list(exact_, leaf_);
    Triangles triangles;
    std::uint32_t place = 0, count = 0;
    const auto pass = [&] {
      f(triangles, keepInOctant(list.octants() + place, octant_, triangles.data(), count));
      place += std::exchange(count, 0);
    };
    list.forEachRun([&](std::uint32_t run) {
      const std::uint32_t first = triangle_run::first(run), length = triangle_run::length(run);
      if (count + length > TriangleChunk::kSize) pass();
      for (std::uint32_t i = 0; i < kAtOnce; ++i) triangles[count + i] = first + i;
      for (std::uint32_t i = kAtOnce; i < length; ++i) triangles[count + i] = first + i;
      count += length;
    });
    pass();
  }

  /// Keeps the triangles of a chunk that can be nearest to a point of the ball with this radius around the origin. No
  /// triangle farther from the origin than d + 2r can be, where d is the distance of the nearest one.
  static void keepNearestToBall(float radius, Triangles& triangles, TriangleChunk& chunk) {
    constexpr float kRounding = 1 + 1e-6F;
    if (chunk.count == 0) return;
    findBounds(chunk);
    const float limit = (leastUpperBound(chunk) + 2 * radius) * kRounding;
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < chunk.count; ++i) {
      for (auto& corner : chunk.corners) corner[kept] = corner[i];
      triangles[kept] = triangles[i];
      kept += static_cast<std::uint32_t>(!(chunk.lower[i] > limit));
    }
    chunk.count = kept;
    fillLastVector(chunk);
  }

  const ExactTriangles& exact_;
  const std::vector<V>& vertices_;
  std::uint64_t leaf_;
  int octant_;
};

/// Returns the signed distance, with its gradient, of a point x whose nearest feature is given.
template <typename V>
ValueAndGradient signedDistance(const OctantTriangles<V>& triangles, const Vector3& x, const NearestFeature& nearest,
                                bool withGradient) {
  const ExactSign sign = triangles.signAt(x);
  const double distance = std::sqrt(nearest.squared);
  ValueAndGradient result{distance, Vector3::Zero()};
  const bool needsNormal = sign == ExactSign::pseudonormal || (withGradient && !(distance > 0));
  const Vector3 normal = needsNormal ? triangles.pseudonormal(nearest) : Vector3::Zero();
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
      result.gradient = nearest.normal.normalized() * triangles.slopeAcross(nearest, x, sign);
    else
      result.gradient = distance > 0 ? Vector3(nearest.difference / result.value) : Vector3(normal.normalized());
  }
  result.value -= triangles.offset();
  return result;
}

template <typename Result>
void evaluateAll(const ExactTriangles& exact, std::uint64_t leaf, int octant, std::span<const Vector3> points,
                 Result* out) {
  std::visit(
      [&](const auto& vertices) {
        const OctantTriangles triangles(exact, vertices, leaf, octant);
        triangles.forEachNearest(points, [&](std::size_t i, const NearestFeature& nearest) {
          if constexpr (std::is_same_v<Result, double>)
            out[i] = signedDistance(triangles, points[i], nearest, false).value;
          else
            out[i] = signedDistance(triangles, points[i], nearest, true);
        });
      },
      exact.vertices);
}

}  // namespace

void evaluateExact(const ExactTriangles& exact, std::uint64_t leaf, int octant, std::span<const Vector3> points,
                   double* out) {
  evaluateAll(exact, leaf, octant, points, out);
}

void evaluateExact(const ExactTriangles& exact, std::uint64_t leaf, int octant, std::span<const Vector3> points,
                   ValueAndGradient* out) {
  evaluateAll(exact, leaf, octant, points, out);
}

}  // namespace hpsdf::query
