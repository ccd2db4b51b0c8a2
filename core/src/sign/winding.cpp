#include "sign/winding.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sign/solid_angle.h"

namespace hpsdf::distance {
namespace {

/// Of one cluster, at each level. Some hundred clusters make a sum.
constexpr std::array<double, Winding::kLevels> kErrors = {1e-2, 5e-4, 2e-5, 5e-7};

double square(double x) { return x * x; }

/// See `Winding`; `ratio` is t. Too great for any use where the series need not converge.
double leftOut(double area, double squaredDistance, double ratio) {
  if (!(ratio < 1)) return HUGE_VAL;
  return area / (4 * std::numbers::pi * squaredDistance) * (1 / square(1 - ratio) - 1 - ratio * (2 + 3 * ratio));
}

/// The least distance at which no more than `error` is left out, squared.
double squaredReach(double area, double radius, double error) {
  if (radius == 0) return 0;
  double low = 0, high = 1;  // of the ratio, up to which little is left out
  for (int i = 0; i < 30; ++i) {
    const double ratio = (low + high) / 2;
    (leftOut(area, square(radius / ratio), ratio) > error ? high : low) = ratio;
  }
  return low > 0 ? square(radius / low) : HUGE_VAL;
}

}  // namespace

/// Makes the clusters of a hierarchy: its nodes' children, down to blocks.
class Winding::Maker {
 public:
  explicit Maker(Winding& winding) : winding_(winding), hierarchy_(*winding.hierarchy_) {
    add(0, 0, static_cast<std::uint32_t>(hierarchy_.triangles().size()));
    winding_.moments_.resize(winding_.places_.size());
    tbb::parallel_for(std::size_t{0}, winding_.places_.size(), [&](std::size_t n) { measure(n); });
  }

 private:
  std::uint32_t firstSlot(std::uint32_t child) const {
    while ((child & kBlockBit) == 0) child = hierarchy_.nodes()[child].child[0];
    return hierarchy_.blocks()[child & ~kBlockBit].first;
  }

  /// Slots below a node or a block follow one another.
  void add(std::uint32_t child, std::uint32_t begin, std::uint32_t end) {
    const std::size_t self = winding_.places_.size();
    winding_.places_.push_back({.begin = begin, .end = end});
    if ((child & kBlockBit) == 0) {
      const Node& node = hierarchy_.nodes()[child];
      for (int i = 0; i < kWidth && node.child[i] != kEmpty; ++i) {
        const bool last = i + 1 == kWidth || node.child[i + 1] == kEmpty;
        add(node.child[i], firstSlot(node.child[i]), last ? end : firstSlot(node.child[i + 1]));
      }
    }
    winding_.places_[self].next = static_cast<std::uint32_t>(winding_.places_.size());
  }

  std::array<Vector3, 3> corners(std::uint32_t slot) const {
    const auto& [a, b, c] = hierarchy_.triangles()[slot];
    return {winding_.vertices_[a], winding_.vertices_[b], winding_.vertices_[c]};
  }

  void measure(std::size_t n) {
    Place& place = winding_.places_[n];
    Moments& moments = winding_.moments_[n];
    Vector3 sum = Vector3::Zero();
    double total = 0;
    for (std::uint32_t slot = place.begin; slot < place.end; ++slot) {
      const auto [a, b, c] = corners(slot);
      const double area = (b - a).cross(c - a).norm() / 2;
      total += area;
      sum += area / 3 * (a + b + c);
    }
    place.center = total > 0 ? Vector3(sum / total) : corners(place.begin)[0];
    for (std::uint32_t slot = place.begin; slot < place.end; ++slot) {
      const auto [a, b, c] = corners(slot);
      add({a - place.center, b - place.center, c - place.center}, moments);
    }
    if (moments.radius > 0) moments.area /= std::pow(moments.radius, 3);
    for (int level = 0; level < kLevels; ++level)
      place.squaredReach[level] = squaredReach(moments.area, moments.radius, kErrors[level]);
  }

  /// A triangle, its corners from the cluster's center.
  static void add(const std::array<Vector3, 3>& v, Moments& moments) {
    const Vector3 normal = (v[1] - v[0]).cross(v[2] - v[0]) / 2, sum = v[0] + v[1] + v[2], mean = sum / 3;
    double cubes = 0;
    for (const Vector3& corner : v) {
      const double distance = corner.norm();
      moments.radius = std::max(moments.radius, distance);
      cubes += distance * distance * distance;
    }
    moments.area += normal.norm() * cubes / 3;  // a convex function's mean is at most that of its corners
    const Eigen::Matrix3d spread =
        (v[0] * v[0].transpose() + v[1] * v[1].transpose() + v[2] * v[2].transpose() + sum * sum.transpose()) / 12;
    moments.first += normal;
    const auto second = [&](int i, int j) { return (normal[i] * mean[j] + normal[j] * mean[i]) / 2; };
    const auto third = [&](int i, int j, int k) {
      return (normal[i] * spread(j, k) + normal[j] * spread(i, k) + normal[k] * spread(i, j)) / 3;
    };
    constexpr int kSecond[][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    for (std::size_t m = 0; m < moments.second.size(); ++m) moments.second[m] += second(kSecond[m][0], kSecond[m][1]);
    constexpr int kThird[][3] = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {0, 0, 1}, {0, 0, 2},
                                 {0, 1, 1}, {1, 1, 2}, {0, 2, 2}, {1, 2, 2}, {0, 1, 2}};
    for (std::size_t m = 0; m < moments.third.size(); ++m)
      moments.third[m] += third(kThird[m][0], kThird[m][1], kThird[m][2]);
  }

  Winding& winding_;
  const Hierarchy& hierarchy_;
};

double Winding::Moments::at(const Vector3& toCenter, double squaredDistance) const {
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

double Winding::Moments::error(double squaredDistance) const {
  return radius == 0 ? 0 : leftOut(area, squaredDistance, radius / std::sqrt(squaredDistance));
}

Winding::Winding(const Hierarchy& hierarchy) : hierarchy_(&hierarchy), vertices_(hierarchy.vertices().size()) {
  tbb::parallel_for(std::size_t{0}, vertices_.size(),
                    [&](std::size_t v) { vertices_[v] = hierarchy.local(hierarchy.vertices()[v]); });
  Maker make(*this);
}

double Winding::sum(const Vector3& local, std::uint32_t begin, std::uint32_t end) const {
  AngleSum angles;
  for (std::uint32_t slot = begin; slot < end; ++slot) {
    const auto& [a, b, c] = hierarchy_->triangles()[slot];
    addHalfAngle(vertices_[a] - local, vertices_[b] - local, vertices_[c] - local, angles);
  }
  return angles.value() / (2 * std::numbers::pi);
}

Winding::Estimate Winding::estimate(const Vector3& x, int level) const {
  const Vector3 local = hierarchy_->local(x);
  Estimate all{0, kRounding};
  double series = 0;
  for (std::size_t n = 0; n < places_.size();) {
    const Place& place = places_[n];
    const Vector3 toCenter = place.center - local;
    const double squared = toCenter.squaredNorm();
    if (squared > place.squaredReach[level]) {
      series += moments_[n].at(toCenter, squared);
      all.error += moments_[n].error(squared);
      n = place.next;
    } else if (++n == place.next) {
      all.value += sum(local, place.begin, place.end);
    }
  }
  all.value += series / (4 * std::numbers::pi);
  return all;
}

double Winding::withoutOne(const Vector3& x, std::uint32_t slot) const {
  return within(x, 0.05, [](const Estimate&) { return false; }).value - sum(hierarchy_->local(x), slot, slot + 1);
}

double Winding::exact(const Vector3& x) const {
  return sum(hierarchy_->local(x), 0, static_cast<std::uint32_t>(hierarchy_->triangles().size()));
}

bool Winding::inside(const Vector3& x, double above) const {
  const auto tells = [&](const Estimate& found) { return std::abs(found.value - above) > found.error; };
  return within(x, 0, tells).value > above;
}

std::size_t Winding::bytes() const {
  return places_.size() * sizeof(Place) + moments_.size() * sizeof(Moments) + vertices_.size() * sizeof(Vector3);
}

}  // namespace hpsdf::distance
