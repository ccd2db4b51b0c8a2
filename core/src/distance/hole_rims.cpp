#include "distance/hole_rims.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "distance/segment.h"
#include "mesh/sides.h"

namespace hpsdf::distance {

HoleRims::HoleRims(const Hierarchy& hierarchy) : HoleRims(hierarchy, sidesByEdge(hierarchy.triangles())) {}

HoleRims::HoleRims(const Hierarchy& hierarchy, const std::vector<hpsdf::Side>& sides) {
  const auto place = [&](std::uint32_t vertex) { return hierarchy.local(hierarchy.vertices()[vertex]); };
  forEachEdge(sides, [&](std::span<const hpsdf::Side> edge) {
    int times = 0;
    for (const hpsdf::Side& side : edge) times += side.rising ? 1 : -1;
    if (times != 0) sides_.push_back({place(edge.front().low()), place(edge.front().high()), double(times)});
  });
}

HoleRims::Gradient HoleRims::gradient(const Vector3& local) const {
  Gradient sum{Vector3::Zero(), 0, HUGE_VAL};
  for (const Side& side : sides_) {
    const Vector3 a = side.from - local, b = side.to - local, along = b - a;
    const double la = a.norm(), lb = b.norm(), product = la * lb;
    const double below = product * (product + a.dot(b));
    if (below > 0) sum.value += side.times * (la + lb) / below * a.cross(b);
    const double nearest = (a + closestParameter(Vector3::Zero(), a, b) * along).norm();
    // ∫2/r³ along the segment, as if all of it were as near, or it went on to both sides for ever
    sum.change += 2 * std::abs(side.times) * std::min(along.norm() / nearest, 2.0) / (nearest * nearest);
    sum.nearest = std::min(sum.nearest, nearest);
  }
  sum.value /= 4 * std::numbers::pi;
  sum.change /= 4 * std::numbers::pi;
  return sum;
}

}  // namespace hpsdf::distance
