#include "view/exact_leaf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <variant>

#include "hpsdf/detail/exact_sign.h"
#include "hpsdf/detail/triangle_list.h"

namespace hpsdf::render {
namespace {

/// The point of a triangle that is closest to another point, and the corners of the triangle's feature (face, edge or
/// vertex) that contains it.
struct Closest {
  Vector3 point;
  std::array<bool, 3> corners;
};

/// Returns the closest point of the side from corner i to corner j.
Closest closestOnSide(const std::array<Vector3, 3>& v, int i, int j, const Vector3& x) {
  const Vector3 along = v[j] - v[i];
  const double t = (x - v[i]).dot(along), squared = along.squaredNorm();
  Closest closest{v[i], {}};
  closest.corners[i] = !(t >= squared) || !(t > 0);
  closest.corners[j] = t > 0;
  if (t >= squared && t > 0)
    closest.point = v[j];
  else if (t > 0)
    closest.point = v[i] + t / squared * along;
  return closest;
}

Closest closestOnTriangle(const std::array<Vector3, 3>& v, const Vector3& x) {
  const Vector3 normal = (v[1] - v[0]).cross(v[2] - v[0]);
  const double squared = normal.squaredNorm();
  bool inside = squared > 0;
  for (int k = 0; k < 3; ++k) inside = inside && (v[(k + 1) % 3] - v[k]).cross(x - v[k]).dot(normal) >= 0;
  if (inside) return {x - (x - v[0]).dot(normal) / squared * normal, {true, true, true}};
  Closest closest = closestOnSide(v, 0, 1, x);
  for (const auto& [i, j] : {std::pair(1, 2), std::pair(0, 2)}) {
    const Closest other = closestOnSide(v, i, j, x);
    if ((other.point - x).squaredNorm() < (closest.point - x).squaredNorm()) closest = other;
  }
  return closest;
}

/// The nearest feature of a list of triangles.
struct NearestFeature {
  double distance = std::numeric_limits<double>::infinity();
  Vector3 point;
  std::array<std::uint32_t, 3> vertices;  ///< the first one for a vertex, two for an edge, all three for a face
  int count;                              ///< number of vertices of the feature
};

NearestFeature nearestFeature(const ExactTriangles& exact, std::uint64_t bits, const Vector3& x) {
  NearestFeature nearest;
  forEachTriangle(exact, bits, [&](std::uint32_t triangle) {
    const Closest closest = closestOnTriangle(cornersOf(exact, triangle), x);
    const double distance = (x - closest.point).norm();
    if (!(distance < nearest.distance)) return;
    nearest = {distance, closest.point, {}, 0};
    for (int k = 0; k < 3; ++k)
      if (closest.corners[k]) nearest.vertices[nearest.count++] = exact.triangles[triangle][k];
  });
  return nearest;
}

/// Returns the angle-weighted pseudonormal of a feature, of unit length.
Vector3 pseudonormal(const ExactTriangles& exact, std::uint64_t bits, const NearestFeature& feature) {
  Vector3 sum = Vector3::Zero();
  forEachTriangle(exact, bits, [&](std::uint32_t triangle) {
    const auto& corners = exact.triangles[triangle];
    for (int i = 0; i < feature.count; ++i)
      if (std::ranges::find(corners, feature.vertices[i]) == corners.end()) return;
    double weight = 1;
    if (feature.count == 1) {
      const auto k = std::ranges::find(corners, feature.vertices[0]) - corners.begin();
      const std::array<Vector3, 3> v = cornersOf(exact, triangle);
      const Vector3 a = v[(k + 1) % 3] - v[k], b = v[(k + 2) % 3] - v[k];
      weight = std::atan2(a.cross(b).norm(), a.dot(b));
    }
    sum += weight * unitNormal(exact, triangle);
  });
  return sum.normalized();
}

/// Returns 1 or −1, the sign of an exact leaf at a point. `pseudonormalSign` is the one that the pseudonormal gives.
int signFrom(const ExactTriangles& exact, std::uint64_t bits, const Vector3& x, int pseudonormalSign) {
  switch (node::exactSign(bits)) {
    case ExactSign::positive:
      return 1;
    case ExactSign::negative:
      return -1;
    case ExactSign::winding:
      return windingAt(exact, bits, x) > 0 ? -1 : 1;
    case ExactSign::pseudonormal:
      break;
  }
  return pseudonormalSign;
}

}  // namespace

std::array<Vector3, 3> cornersOf(const ExactTriangles& exact, std::uint32_t triangle) {
  const auto& corners = exact.triangles[triangle];
  return std::visit(
      [&](const auto& v) -> std::array<Vector3, 3> {
        return {v[corners[0]].template cast<double>(), v[corners[1]].template cast<double>(),
                v[corners[2]].template cast<double>()};
      },
      exact.vertices);
}

Vector3 unitNormal(const ExactTriangles& exact, std::uint32_t triangle) {
  const std::array<Vector3, 3> v = cornersOf(exact, triangle);
  const Vector3 normal = (v[1] - v[0]).cross(v[2] - v[0]);
  const double length = normal.norm();
  return length > 0 ? Vector3(normal / length) : Vector3(Vector3::Zero());
}

ValueAndGradient evaluateExactLeaf(const ExactTriangles& exact, std::uint64_t bits, const Vector3& x) {
  const NearestFeature nearest = nearestFeature(exact, bits, x);
  const Vector3 normal = pseudonormal(exact, bits, nearest), away = x - nearest.point;
  const bool outside = away.dot(normal) >= 0;
  const bool positive = signFrom(exact, bits, x, outside ? 1 : -1) > 0;
  const double value = positive ? nearest.distance : -nearest.distance;
  if (nearest.count == 3 && node::exactSign(bits) == ExactSign::winding)
    return {value - exact.offset, slopeByWinding(exact, bits, x, normal, away.dot(normal)) * normal};
  if (nearest.count == 3 || !(nearest.distance > 0))
    return {value - exact.offset, positive == outside ? normal : Vector3(-normal)};
  return {value - exact.offset, away / value};
}

std::optional<Crossing> firstCrossing(const ExactTriangles& exact, std::uint64_t bits, const RayPart& ray,
                                      double side) {
  std::optional<Crossing> first;
  forEachTriangle(exact, bits, [&](std::uint32_t triangle) {
    std::array<Vector3, 3> v = cornersOf(exact, triangle);
    for (Vector3& corner : v) corner -= ray.start;
    // The weight of a corner is the volume that the ray's direction spans with the opposite side. Two triangles compute
    // the volume of their common edge with opposite signs, so that no ray passes between them.
    std::array<double, 3> weight;
    double sum = 0, along = 0;
    for (int k = 0; k < 3; ++k) {
      weight[k] = -side * ray.direction.dot(v[(k + 1) % 3].cross(v[(k + 2) % 3]));
      if (weight[k] < 0) return;
      sum += weight[k];
      along += weight[k] * v[k].dot(ray.direction);
    }
    const double t = along / sum;
    if (sum > 0 && t >= ray.first && t <= ray.last && (!first || t < first->t)) first = Crossing{t, triangle};
  });
  return first;
}

}  // namespace hpsdf::render
