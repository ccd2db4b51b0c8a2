#include "field/query/exact_leaf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <variant>

#include "field/query/nearest_filter.h"
#include "hpsdf/detail/exact_sign.h"
#include "hpsdf/detail/triangle_list.h"
#include "mesh/triangle_bounds.h"

namespace hpsdf::query {
namespace {

using mesh::TriangleChunk;

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
using Triangles = std::array<std::uint32_t, TriangleChunk::kSize + kFilterWidth>;

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

/// The triangles that matter in one octant of an exact leaf.
template <typename V>
class OctantTriangles {
 public:
  OctantTriangles(const ExactTriangles& exact, const std::vector<V>& vertices, std::uint64_t leaf, int octant)
      : exact_(exact), vertices_(vertices), leaf_(leaf), octant_(octant) {}

  NearestFeature nearestTo(const Vector3& x) const {
    FeatureSearch<V> search(exact_, vertices_, x);
    forEachChunk(x, 0, [&](const Triangles& triangles, std::uint32_t count) {
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
    Box box;
    for (const Vector3& x : points) box.extend(x);
    const Vector3 origin = box.center();
    forEachChunk(origin, box.sizes().norm() / 2, [&](Triangles& triangles, std::uint32_t count) {
      TriangleChunk chunk;
      const bool hasBounds = count > kFew;
      if (hasBounds) loadCorners(source(origin), triangles.data(), count, chunk);
      for (std::size_t i = 0; i < points.size(); ++i) {
        FeatureSearch<V> search(exact_, vertices_, points[i]);
        const float limit = hasBounds ? findBounds(chunk, (points[i] - origin).template cast<float>()) : 0;
        for (std::uint32_t n = 0; n < count; ++n)
          if (!hasBounds || !(chunk.lower[n] > limit)) search.tryTriangle(triangles[n]);
        f(i, search.best());
      }
    });
  }

  /// Returns the pseudonormal of the nearest feature, not normalized.
  Vector3 pseudonormal(const NearestFeature& feature) const {
    if (feature.corners == 3) return feature.normal;
    Vector3 sum = Vector3::Zero();
    forEachTriangleAt(feature, [&](const std::array<std::uint32_t, 3>& corners, int at) {
      const Vector3 origin = vertex(corners[at]);
      const Vector3 next = vertex(corners[(at + 1) % 3]) - origin, previous = vertex(corners[(at + 2) % 3]) - origin;
      const Vector3 normal = next.cross(previous);
      const double length = normal.norm();
      if (!(length > 0)) return;
      if (feature.corners == 1)
        sum += std::atan2(length, next.dot(previous)) / length * normal;
      else
        sum += normal / length;
    });
    return sum;
  }

  /// Returns the Hessian of the distance, without a sign, at a point whose nearest feature is given; 0 at the feature.
  ///
  /// In general the derivative of the closest point is the projection onto the directions of the triangles at the
  /// feature that are perpendicular to the difference, and the distance curves in the other directions only. At an edge
  /// this is the edge's own direction and at a vertex there is none, unless the difference is also perpendicular to a
  /// triangle or to another edge: an edge between two coplanar triangles, or a vertex within an edge, does not curve.
  Eigen::Matrix3d hessian(const NearestFeature& feature) const {
    if (feature.corners == 3 || !(feature.squared > 0)) return Eigen::Matrix3d::Zero();
    const Vector3 normal = feature.difference.normalized();
    Eigen::Matrix3d curved = Eigen::Matrix3d::Identity() - normal * normal.transpose();
    const auto flatten = [&](const Vector3& direction) {
      const Vector3 rest = curved * direction;
      if (rest.norm() > kParallel * direction.norm()) curved -= rest * rest.transpose() / rest.squaredNorm();
    };
    const Vector3 origin = vertex(feature.vertex[0]);
    if (feature.corners == 2) flatten(vertex(feature.vertex[1]) - origin);
    forEachTriangleAt(feature, [&](const std::array<std::uint32_t, 3>& corners, int at) {
      for (const int other : {1, 2}) {
        const Vector3 side = vertex(corners[(at + other) % 3]) - origin;
        if (std::abs(side.dot(normal)) <= kPerpendicular * side.norm()) flatten(side);
      }
    });
    return curved / std::sqrt(feature.squared);
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
  static constexpr std::uint32_t kFew = 3;        ///< so few triangles are tried without bounds
  static constexpr double kPerpendicular = 1e-9;  ///< cosine up to which rounding may hide that two directions are
  static constexpr double kParallel = 1e-5;       ///< sine up to which two directions count as one

  Vector3 vertex(std::uint32_t index) const { return vertices_[index].template cast<double>(); }

  /// Calls f(corners, at) for each triangle of the list that has the given edge or vertex. The feature's first vertex
  /// is the corner number `at`.
  template <typename F>
  void forEachTriangleAt(const NearestFeature& feature, const F& f) const {
    forEachTriangle(exact_, leaf_, [&](std::uint32_t triangle) {
      const auto& corners = exact_.triangles[triangle];
      int at = -1;
      for (int k = 0; k < 3; ++k)
        if (corners[k] == feature.vertex[0]) at = k;
      const auto isCorner = [&](std::uint32_t vertex) { return std::ranges::find(corners, vertex) != corners.end(); };
      if (at >= 0 && (feature.corners == 1 || isCorner(feature.vertex[1]))) f(corners, at);
    });
  }

  CornerSource<V> source(const Vector3& origin) const { return {exact_.triangles, vertices_, origin}; }

  /// Returns the octants of the list's triangles, and the words behind them.
  std::span<const std::uint8_t> octants(const TriangleListView& list) const {
    const auto* end = reinterpret_cast<const std::uint8_t*>(exact_.lists.data() + exact_.lists.size());
    return {list.octants(), end};
  }

  /// Calls f(triangles, count) with the triangles that can be nearest to a point of the ball with this radius around
  /// the origin, from up to a chunk of the list at a time. `f` may change the numbers behind the last triangle.
  template <typename F>
  void forEachChunk(const Vector3& origin, double radius, const F& f) const {
    const TriangleListView list(exact_, leaf_);
    ListPart rest{list.runs(), octants(list)};
    Triangles triangles;
    float nearest = std::numeric_limits<float>::infinity();
    while (rest.run != nullptr) {
      const std::uint32_t count =
          keepNearest(source(origin), rest, octant_, static_cast<float>(radius), triangles.data(), nearest);
      f(triangles, count);
    }
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

template <typename V>
void setResult(const OctantTriangles<V>& triangles, const Vector3& x, const NearestFeature& nearest, double& result) {
  result = signedDistance(triangles, x, nearest, false).value;
}
template <typename V>
void setResult(const OctantTriangles<V>& triangles, const Vector3& x, const NearestFeature& nearest,
               ValueAndGradient& result) {
  result = signedDistance(triangles, x, nearest, true);
}
template <typename V>
void setResult(const OctantTriangles<V>& triangles, const Vector3& x, const NearestFeature& nearest,
               ValueGradientHessian& result) {
  setFirstDerivatives(result, signedDistance(triangles, x, nearest, true));
  const bool isNegative = result.gradient.dot(nearest.difference) < 0;
  result.hessian = (isNegative ? -1 : 1) * triangles.hessian(nearest);
}

template <typename Result>
void evaluateAll(const ExactTriangles& exact, std::uint64_t leaf, int octant, std::span<const Vector3> points,
                 Result* out) {
  std::visit(
      [&](const auto& vertices) {
        const OctantTriangles triangles(exact, vertices, leaf, octant);
        triangles.forEachNearest(points, [&](std::size_t i, const NearestFeature& nearest) {
          setResult(triangles, points[i], nearest, out[i]);
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

void evaluateExact(const ExactTriangles& exact, std::uint64_t leaf, int octant, std::span<const Vector3> points,
                   ValueGradientHessian* out) {
  evaluateAll(exact, leaf, octant, points, out);
}

double thinness(const ExactTriangles& exact, std::uint64_t leaf) {
  const auto vertex = [&](std::uint32_t index) {
    return std::visit([&](const auto& v) { return Vector3(v[index].template cast<double>()); }, exact.vertices);
  };
  double thinnest = 1;
  forEachTriangle(exact, leaf, [&](std::uint32_t triangle) {
    const auto& corners = exact.triangles[triangle];
    const Vector3 a = vertex(corners[0]), b = vertex(corners[1]), c = vertex(corners[2]);
    const double normal = (b - a).cross(c - a).norm();
    const double longest = std::max({(b - a).squaredNorm(), (c - a).squaredNorm(), (c - b).squaredNorm()});
    if (normal > 0) thinnest = std::max(thinnest, longest / normal);
  });
  return thinnest;
}

}  // namespace hpsdf::query
