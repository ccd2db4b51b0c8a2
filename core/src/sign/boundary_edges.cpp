#include "sign/boundary_edges.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "bvh/segment.h"

namespace hpsdf::distance {
namespace {

constexpr std::uint32_t kFew = 512;     // fewer sides are one cluster that never stands for them
constexpr std::uint32_t kSmallest = 8;  // sides of a cluster that is not halved
constexpr double kCoarsest = 0.25;      // ratio of a cluster's size to its distance

double cube(double x) { return x * x * x; }

/// ε_ijk M_jk: of a⊗b it is a×b.
Vector3 axial(const Eigen::Matrix3d& m) { return {m(1, 2) - m(2, 1), m(2, 0) - m(0, 2), m(0, 1) - m(1, 0)}; }

}  // namespace

BoundaryEdges::BoundaryEdges(const Hierarchy& hierarchy)
    : BoundaryEdges(hierarchy, sidesByEdge(hierarchy.triangles())) {}

BoundaryEdges::BoundaryEdges(const Hierarchy& hierarchy, const std::vector<hpsdf::Side>& sides) {
  const auto place = [&](std::uint32_t vertex) { return hierarchy.local(hierarchy.vertices()[vertex]); };
  forEachEdge(sides, [&](std::span<const hpsdf::Side> edge) {
    int times = 0;
    for (const hpsdf::Side& side : edge) times += side.rising ? 1 : -1;
    if (times != 0) sides_.push_back({place(edge.front().low()), place(edge.front().high()), double(times)});
  });
  const auto count = static_cast<std::uint32_t>(sides_.size());
  if (count < kFew) {
    clusters_ = {Cluster{.end = count, .next = 1}};
  } else {
    cluster(0, count);
    tbb::parallel_for(std::size_t{0}, clusters_.size(), [&](std::size_t n) { measure(clusters_[n]); });
  }
}

/// Halves them where they extend the farthest, down to a few.
void BoundaryEdges::cluster(std::uint32_t begin, std::uint32_t end) {
  const std::size_t self = clusters_.size();
  clusters_.push_back(Cluster{.begin = begin, .end = end});
  if (end - begin > kSmallest) {
    Box middles;
    for (std::uint32_t s = begin; s < end; ++s) middles.extend((sides_[s].from + sides_[s].to) / 2);
    Eigen::Index axis = 0;
    middles.sizes().maxCoeff(&axis);
    const std::uint32_t half = begin + (end - begin) / 2;
    std::ranges::nth_element(sides_.begin() + begin, sides_.begin() + half, sides_.begin() + end, {},
                             [axis](const Side& side) { return side.from[axis] + side.to[axis]; });
    cluster(begin, half);
    cluster(half, end);
  }
  clusters_[self].next = static_cast<std::uint32_t>(clusters_.size());
}

void BoundaryEdges::measure(Cluster& cluster) const {
  Box box;
  for (std::uint32_t s = cluster.begin; s < cluster.end; ++s) box.extend(sides_[s].from).extend(sides_[s].to);
  cluster.center = box.center();
  cluster.radius = 0;
  for (std::uint32_t s = cluster.begin; s < cluster.end; ++s) cluster.add(sides_[s]);
}

void BoundaryEdges::Cluster::add(const Side& side) {
  const Vector3 a = side.from - center, b = side.to - center, sum = a + b, along = side.times * (b - a);
  const double itsLength = along.norm();
  radius = std::max({radius, a.norm(), b.norm()});
  length += itsLength;
  cubes += itsLength * (cube(a.norm()) + cube(b.norm())) / 2;  // a convex function's mean is at most that of its ends
  first += along;
  second += sum / 2 * along.transpose();
  const Eigen::Matrix3d spread = (a * a.transpose() + b * b.transpose() + sum * sum.transpose()) / 6;
  for (int k = 0; k < 3; ++k) third[k] += along[k] * spread;
}

Vector3 BoundaryEdges::Cluster::at(const Vector3& toCenter, double squaredDistance) const {
  const double inverse = 1 / squaredDistance;
  const Vector3 traces(third[0].trace(), third[1].trace(), third[2].trace());
  Eigen::Matrix3d towards;
  for (int k = 0; k < 3; ++k) towards.col(k) = inverse * third[k] * toCenter;
  const Vector3 higher = (second - 2.5 * towards).transpose() * toCenter + traces / 2;
  return inverse * std::sqrt(inverse) * (axial(second - 3 * towards) + toCenter.cross(first - 3 * inverse * higher));
}

inline void BoundaryEdges::Side::addTo(Gradient& sum, const Vector3& local) const {
  const Vector3 a = from - local, b = to - local, along = b - a;
  const double la = a.norm(), lb = b.norm(), product = la * lb;
  const double below = product * (product + a.dot(b));
  if (below > 0) sum.value += times * (la + lb) / below * a.cross(b);
  const double nearest = (a + closestParameter(Vector3::Zero(), a, b) * along).norm();
  // ∫2/r³ along the segment, as if all of it were as near, or it went on to both sides for ever
  sum.change += 2 * std::abs(times) * std::min(along.norm() / nearest, 2.0) / (nearest * nearest);
  sum.nearest = std::min(sum.nearest, nearest);
  ++sum.terms;
}

BoundaryEdges::Gradient BoundaryEdges::sum(const Vector3& local, double ratio) const {
  Gradient sum;
  const double leftOut = (4 - 3 * ratio) / ((1 - ratio) * (1 - ratio));
  for (std::size_t n = 0; n < clusters_.size();) {
    const Cluster& cluster = clusters_[n];
    const Vector3 toCenter = cluster.center - local;
    const double squared = toCenter.squaredNorm(), distance = std::sqrt(squared);
    if (cluster.radius < ratio * distance) {
      const double nearest = distance - cluster.radius;
      sum.value += cluster.at(toCenter, squared);
      sum.error += leftOut * cluster.cubes / (squared * squared * distance);
      sum.change += 2 * cluster.length / cube(nearest);  // ∫2/r³, as if all of it were as near
      sum.nearest = std::min(sum.nearest, nearest);
      ++sum.terms;
      n = cluster.next;
    } else if (++n == cluster.next) {
      for (std::uint32_t s = cluster.begin; s < cluster.end; ++s) sides_[s].addTo(sum, local);
    }
  }
  constexpr double kAll = 4 * std::numbers::pi;
  return {sum.value / kAll, sum.error / kAll, sum.change / kAll, sum.nearest, sum.terms};
}

BoundaryEdges::Gradient BoundaryEdges::gradient(const Vector3& local, double error) const {
  for (double ratio = kCoarsest;;) {
    const Gradient found = sum(local, ratio);
    if (found.error <= error) return found;
    ratio *= 0.9 * std::cbrt(error / found.error);  // what is left out falls with its cube
  }
}

}  // namespace hpsdf::distance
