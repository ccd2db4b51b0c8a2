#include "field/query/exact_leaf.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <variant>

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

/// Evaluates the exact leaf's list at one point.
template <typename V>
class ListSearch {
 public:
  ListSearch(const ExactTriangles& exact, const std::vector<V>& vertices, std::uint64_t leaf, const Vector3& x)
      : exact_(exact), vertices_(vertices.data()), leaf_(leaf), x_(x) {
    for (int axis = 0; axis < 3; ++axis) {
      const double high = leadingDigits(x[axis]);
      xHigh_[axis] = static_cast<float>(high);
      xLow_[axis] = static_cast<float>(x[axis] - high);
    }
  }

  NearestFeature nearest() {
    TriangleChunk chunk;
    std::array<std::uint32_t, TriangleChunk::kSize> triangles;
    forEachTriangle(exact_, leaf_, [&](std::uint32_t triangle) {
      if (chunk.count == TriangleChunk::kSize) search(chunk, triangles);
      triangles[chunk.count++] = triangle;
    });
    search(chunk, triangles);
    return best_;
  }

  /// Returns the pseudonormal of the nearest feature, not normalized.
  Vector3 pseudonormal(const NearestFeature& feature) const {
    if (feature.corners == 3) return feature.normal;
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

 private:
  Vector3 vertex(std::uint32_t index) const { return vertices_[index].template cast<double>(); }

  /// Finds the nearest triangle of a chunk in double precision, among those that single precision cannot exclude.
  /// Empties the chunk.
  void search(TriangleChunk& chunk, const std::array<std::uint32_t, TriangleChunk::kSize>& triangles) {
    constexpr std::size_t kFew = 3;  // so few triangles are tried at once
    if (chunk.count <= kFew) {
      for (std::size_t i = 0; i < chunk.count; ++i) tryTriangle(triangles[i]);
    } else {
      loadCorners(chunk, triangles);
      findBounds(chunk);
      for (std::size_t i = 0; i < chunk.count; ++i)
        if (chunk.upper[i] < limit_) limit_ = chunk.upper[i];
      for (std::size_t i = 0; i < chunk.count; ++i)
        if (!(chunk.lower[i] > limit_)) tryTriangle(triangles[i]);
    }
    chunk.count = 0;
  }

  void loadCorners(TriangleChunk& chunk, const std::array<std::uint32_t, TriangleChunk::kSize>& triangles) const {
    for (std::size_t i = 0; i < chunk.count; ++i) {
      const auto& corners = exact_.triangles[triangles[i]];
      for (int k = 0; k < 3; ++k) setRelative(vertices_[corners[k]], chunk.corners[k][i]);
    }
  }

  /// Sets `out` to a vertex minus the query point, coordinate by coordinate, because a vector of four floats that is
  /// put together from three is slow to store. The subtraction of the query point in two parts keeps the relative error
  /// small.
  void setRelative(const Eigen::Vector3f& v, Eigen::Vector4f& out) const {
    for (int axis = 0; axis < 3; ++axis) out[axis] = (v[axis] - xHigh_[axis]) - xLow_[axis];
  }
  void setRelative(const Eigen::Vector3d& v, Eigen::Vector4f& out) const {
    for (int axis = 0; axis < 3; ++axis) out[axis] = static_cast<float>(v[axis] - x_[axis]);
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

  const ExactTriangles& exact_;
  const V* vertices_;
  std::uint64_t leaf_;
  Vector3 x_;
  Eigen::Vector3f xHigh_, xLow_;  ///< x as a sum of two floats
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
