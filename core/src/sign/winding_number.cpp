#include "sign/winding_number.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sign/solid_angle.h"

namespace hpsdf::sign {
namespace {

/// The greatest truncation error that one cluster may have, by accuracy level. A winding number is a sum over about a
/// hundred clusters.
constexpr std::array<double, WindingNumber::kLevels> kErrors = {1e-2, 5e-4, 2e-5, 5e-7};

double square(double x) { return x * x; }

/// Returns the bound of the Taylor series' truncation error, A/(4πR²) · (1/(1−t)² − 1 − 2t − 3t²), where A is `area`,
/// R² is `squaredDistance` and t is `ratio`. Returns infinity if t is 1 or more, because the series may diverge.
double truncationError(double area, double squaredDistance, double ratio) {
  if (!(ratio < 1)) return HUGE_VAL;
  return area / (4 * std::numbers::pi * squaredDistance) * (1 / square(1 - ratio) - 1 - ratio * (2 + 3 * ratio));
}

/// Returns the square of the smallest distance from a cluster at which the truncation error of the cluster's Taylor
/// series is at most `error`. Finds it by bisection of the ratio t = radius / distance.
double squaredFarDistance(double area, double radius, double error) {
  if (radius == 0) return 0;
  double low = 0, high = 1;
  for (int i = 0; i < 30; ++i) {
    const double ratio = (low + high) / 2;
    (truncationError(area, square(radius / ratio), ratio) > error ? high : low) = ratio;
  }
  return low > 0 ? square(radius / low) : HUGE_VAL;
}

}  // namespace

/// Adds the cluster of a node or block of the hierarchy and, recursively, the clusters of its children. The
/// triangles of the node or block are in the slots [begin, end).
void WindingNumber::addCluster(std::uint32_t child, std::uint32_t begin, std::uint32_t end) {
  const auto firstSlot = [&](std::uint32_t of) {
    while ((of & bvh::kBlockBit) == 0) of = hierarchy_->nodes()[of].child[0];
    return (of & ~bvh::kBlockBit) * std::uint32_t(bvh::kWidth);
  };
  const std::size_t self = clusters_.size();
  clusters_.push_back({.begin = begin, .end = end});
  if ((child & bvh::kBlockBit) == 0) {
    const bvh::Node& node = hierarchy_->nodes()[child];
    for (int i = 0; i < bvh::kWidth && node.child[i] != bvh::kEmpty; ++i) {
      const bool last = i + 1 == bvh::kWidth || node.child[i + 1] == bvh::kEmpty;
      addCluster(node.child[i], firstSlot(node.child[i]), last ? end : firstSlot(node.child[i + 1]));
    }
  } else {
    clusters_[self].block = child & ~bvh::kBlockBit;
  }
  clusters_[self].next = static_cast<std::uint32_t>(clusters_.size());
}

/// Fills the block of a cluster that is not divided.
void WindingNumber::fill(AngleBlock& block, const Cluster& cluster) const {
  for (std::uint32_t place = 0; place < bvh::kWidth; ++place) {
    const bool isUsed = cluster.begin + place < cluster.end;
    const std::array<Vector3, 3> v = corners(isUsed ? cluster.begin + place : cluster.begin);
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis) block.corner[k][axis][place] = v[isUsed ? k : 0][axis];
  }
}

std::array<Vector3, 3> WindingNumber::corners(std::uint32_t slot) const {
  const auto& [a, b, c] = hierarchy_->triangles()[slot];
  const auto vertices = hierarchy_->vertices();
  return {hierarchy_->local(vertices[a]), hierarchy_->local(vertices[b]), hierarchy_->local(vertices[c])};
}

/// Computes center, moments and far distances of a cluster.
void WindingNumber::measure(Cluster& cluster, Moments& moments) const {
  Vector3 sum = Vector3::Zero();
  double total = 0;
  for (std::uint32_t slot = cluster.begin; slot < cluster.end; ++slot) {
    const auto [a, b, c] = corners(slot);
    const double area = (b - a).cross(c - a).norm() / 2;
    total += area;
    sum += area / 3 * (a + b + c);
  }
  cluster.center = total > 0 ? Vector3(sum / total) : corners(cluster.begin)[0];
  for (std::uint32_t slot = cluster.begin; slot < cluster.end; ++slot) {
    const auto [a, b, c] = corners(slot);
    moments.add({a - cluster.center, b - cluster.center, c - cluster.center});
  }
  if (moments.radius > 0) moments.area /= std::pow(moments.radius, 3);
  for (int level = 0; level < kLevels; ++level)
    cluster.squaredFarDistance[level] = squaredFarDistance(moments.area, moments.radius, kErrors[level]);
}

void WindingNumber::Moments::add(const std::array<Vector3, 3>& v) {
  const Vector3 normal = (v[1] - v[0]).cross(v[2] - v[0]) / 2, sum = v[0] + v[1] + v[2], mean = sum / 3;
  double cubes = 0;
  for (const Vector3& corner : v) {
    const double distance = corner.norm();
    radius = std::max(radius, distance);
    cubes += distance * distance * distance;
  }
  area += normal.norm() * cubes / 3;  // the mean of the convex |v|³ is at most the mean of its corner values
  const Eigen::Matrix3d spread =
      (v[0] * v[0].transpose() + v[1] * v[1].transpose() + v[2] * v[2].transpose() + sum * sum.transpose()) / 12;
  first += normal;
  const auto ofSecond = [&](int i, int j) { return (normal[i] * mean[j] + normal[j] * mean[i]) / 2; };
  const auto ofThird = [&](int i, int j, int k) {
    return (normal[i] * spread(j, k) + normal[j] * spread(i, k) + normal[k] * spread(i, j)) / 3;
  };
  constexpr int kSecond[][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
  for (std::size_t m = 0; m < second.size(); ++m) second[m] += ofSecond(kSecond[m][0], kSecond[m][1]);
  constexpr int kThird[][3] = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {0, 0, 1}, {0, 0, 2},
                               {0, 1, 1}, {1, 1, 2}, {0, 2, 2}, {1, 2, 2}, {0, 1, 2}};
  for (std::size_t m = 0; m < third.size(); ++m) third[m] += ofThird(kThird[m][0], kThird[m][1], kThird[m][2]);
}

double WindingNumber::Moments::series(const Vector3& toCenter, double squaredDistance) const {
  const double x = toCenter.x(), y = toCenter.y(), z = toCenter.z();
  const double inverse = 1 / squaredDistance, cubed = inverse * std::sqrt(inverse);
  const auto [xx, yy, zz, xy, xz, yz] = second;
  const double quadratic = xx * x * x + yy * y * y + zz * z * z + 2 * (xy * x * y + xz * x * z + yz * y * z);
  const auto [xxx, yyy, zzz, xxy, xxz, xyy, yyz, xzz, yzz, xyz] = third;
  const double cubic = x * (xxx * x * x + 3 * (xyy * y * y + xzz * z * z)) +
                       y * (yyy * y * y + 3 * (xxy * x * x + yzz * z * z)) +
                       z * (zzz * z * z + 3 * (xxz * x * x + yyz * y * y)) + 6 * xyz * x * y * z;
  const double traces = (xxx + xyy + xzz) * x + (xxy + yyy + yzz) * y + (xxz + yyz + zzz) * z;
  return cubed * (first.dot(toCenter) + (xx + yy + zz) - 3 * inverse * quadratic +
                  inverse * (7.5 * inverse * cubic - 4.5 * traces));
}

double WindingNumber::Moments::error(double squaredDistance) const {
  return radius == 0 ? 0 : truncationError(area, squaredDistance, radius / std::sqrt(squaredDistance));
}

WindingNumber::WindingNumber(const bvh::Hierarchy& hierarchy)
    : hierarchy_(&hierarchy), blocks_(hierarchy.blocks().size()) {
  addCluster(0, 0, static_cast<std::uint32_t>(hierarchy.triangles().size()));
  moments_.resize(clusters_.size());
  tbb::parallel_for(std::size_t{0}, clusters_.size(), [&](std::size_t n) {
    measure(clusters_[n], moments_[n]);
    if (clusters_[n].next == n + 1) fill(blocks_[clusters_[n].block], clusters_[n]);
  });
}

WindingNumber::Estimate WindingNumber::estimate(const Vector3& x, int level) const {
  const Vector3 local = hierarchy_->local(x);
  Estimate all{0, kRounding};
  BlockAngles angles;
  double series = 0;
  for (std::size_t n = 0; n < clusters_.size();) {
    const Cluster& cluster = clusters_[n];
    const Vector3 toCenter = cluster.center - local;
    const double squared = toCenter.squaredNorm();
    if (squared > cluster.squaredFarDistance[level]) {
      series += moments_[n].series(toCenter, squared);
      all.error += moments_[n].error(squared);
      n = cluster.next;
    } else if (++n == cluster.next) {  // the cluster has no children
      addHalfSolidAngles(blocks_[cluster.block], local, angles);
    }
  }
  all.value = angles.value() / (2 * std::numbers::pi) + series / (4 * std::numbers::pi);
  return all;
}

double WindingNumber::withoutTriangle(const Vector3& x, std::uint32_t slot) const {
  const Estimate all = estimateWithin(x, 0.05, [](const Estimate&) { return false; });
  const Vector3 local = hierarchy_->local(x);
  const auto [a, b, c] = corners(slot);
  AngleSum angle;
  addHalfSolidAngle(a - local, b - local, c - local, angle);
  return all.value - angle.value() / (2 * std::numbers::pi);
}

double WindingNumber::exact(const Vector3& x) const {
  BlockAngles angles;
  for (const AngleBlock& block : blocks_) addHalfSolidAngles(block, hierarchy_->local(x), angles);
  return angles.value() / (2 * std::numbers::pi);
}

bool WindingNumber::isAbove(const Vector3& x, double level) const {
  const auto decides = [&](const Estimate& found) { return std::abs(found.value - level) > found.error; };
  return estimateWithin(x, 0, decides).value > level;
}

std::size_t WindingNumber::bytes() const {
  return clusters_.size() * sizeof(Cluster) + moments_.size() * sizeof(Moments) + blocks_.size() * sizeof(AngleBlock);
}

}  // namespace hpsdf::sign
