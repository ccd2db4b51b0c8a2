#include "distance/hole_rims.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "distance/segment.h"
#include "mesh/sides.h"

namespace hpsdf::distance {
namespace {

double distanceTo(const Vector3& x, const Vector3& a, const Vector3& b) {
  return (x - a - closestParameter(x, a, b) * (b - a)).norm();
}

}  // namespace

HoleRims::HoleRims(const Hierarchy& hierarchy) {
  const std::vector<hpsdf::Side> sides = sidesByEdge(hierarchy.triangles());
  const auto place = [&](std::uint32_t vertex) { return hierarchy.local(hierarchy.vertices()[vertex]); };
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    int times = 0;
    for (; end < sides.size() && sides[end].edge == sides[begin].edge; ++end) times += sides[end].rising ? 1 : -1;
    if (times != 0) sides_.push_back({place(sides[begin].low()), place(sides[begin].high()), double(times)});
  }
}

Vector3 HoleRims::gradient(const Vector3& local) const {
  Vector3 sum = Vector3::Zero();
  for (const Side& side : sides_) {
    const Vector3 a = side.from - local, b = side.to - local;
    const double la = a.norm(), lb = b.norm(), product = la * lb;
    const double below = product * (product + a.dot(b));
    if (below > 0) sum += side.times * (la + lb) / below * a.cross(b);
  }
  return sum / (4 * std::numbers::pi);
}

double HoleRims::greatestGradient(const Vector3& local, double within) const {
  double sum = 0;
  for (const Side& side : sides_) {
    const double nearest = distanceTo(local, side.from, side.to) - within;
    if (!(nearest > 0)) return HUGE_VAL;
    sum += std::abs(side.times) * (side.to - side.from).norm() / (nearest * nearest);
  }
  return sum / (4 * std::numbers::pi);
}

}  // namespace hpsdf::distance
