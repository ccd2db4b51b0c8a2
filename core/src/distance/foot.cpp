#include "distance/foot.h"

#include "bvh/triangle_frame.h"

namespace hpsdf::distance {

Foot footOf(const bvh::Hierarchy& triangles, const sign::Pseudonormals* normals, const Vector3& x,
            const bvh::Nearest& nearest) {
  const std::uint32_t slot = nearest.slot;
  const bvh::FramePoint& point = nearest.point;
  std::uint32_t side = point.side[1] < point.side[0] ? 1 : 0;
  if (point.side[2] < point.side[side]) side = 2;
  // If the point projects onto an edge up to rounding errors, the closest point is not in the interior of the face.
  const double rounding = bvh::kFlat * bvh::kFlat * (nearest.length * nearest.length + point.height * point.height);
  if (point.inside && point.side[side] > rounding)  // adding 0 turns -0 into 0
    return {x - nearest.normal * point.height, point.height + 0.0, slot, Feature::face};

  const std::uint32_t from = (nearest.firstCorner + side) % 3, to = (from + 1) % 3;
  const std::uint32_t va = triangles.triangles()[slot][from], vb = triangles.triangles()[slot][to];
  const Vector3& a = triangles.vertices()[va];
  const Vector3& b = triangles.vertices()[vb];
  const double t = bvh::closestParameter(x, a, b);
  const auto footAt = [&](const Vector3& foot, const Vector3& difference, const Vector3& normal, Feature feature,
                          std::uint32_t index) {
    // `difference` is x − foot, computed without the rounding error of the foot, which is large far from the origin.
    const double length = difference.norm();
    return Foot{
        foot, (difference.dot(normal) < 0 ? -length : length) + 0.0, slot, feature, static_cast<std::uint8_t>(index),
        t};
  };
  const auto ofVertex = [&](std::uint32_t vertex) {
    return normals != nullptr ? normals->ofVertex(vertex) : Vector3(Vector3::Zero());
  };
  if (t <= 0) return footAt(a, x - a, ofVertex(va), Feature::vertex, from);
  if (t >= 1) return footAt(b, x - b, ofVertex(vb), Feature::vertex, to);
  const Vector3 normal = normals != nullptr ? normals->ofEdge(triangles, slot, from) : Vector3(Vector3::Zero());
  return footAt(a + (b - a) * t, x - a - (b - a) * t, normal, Feature::edge, from);
}

Vector3 directionFrom(const Foot& closest, const Vector3& x, const bvh::Nearest& nearest) {
  constexpr double kRounding = 1e-8;  // far more than the relative rounding error of a closest point
  const Vector3 difference = x - closest.point;
  const double length = difference.norm();
  if (closest.feature != Feature::face && length > kRounding * x.cwiseAbs().maxCoeff()) return difference / length;
  return nearest.point.height < 0 ? Vector3(-nearest.normal) : nearest.normal;
}

}  // namespace hpsdf::distance
