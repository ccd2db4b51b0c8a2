#include "hpsdf/physics/sphere_tree.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace hpsdf::physics {
namespace {

constexpr std::uint32_t kLeafPoints = 16;  // 8 or 32 change the time of the benchmark contacts/pile by at most 20 %
constexpr int kFitSteps = 64;              // gives radii within a few percent of the smallest possible radii

class Builder {
 public:
  explicit Builder(std::span<const Vector3> points) : points_(points) {
    tree_.order.resize(points.size());
    std::iota(tree_.order.begin(), tree_.order.end(), 0u);
  }

  SphereTree build() {
    add(0, static_cast<std::uint32_t>(points_.size()));
    return std::move(tree_);
  }

 private:
  void add(std::uint32_t begin, std::uint32_t end) {
    const std::size_t self = tree_.spheres.size();
    Box box;
    for (std::uint32_t i = begin; i < end; ++i) box.extend(point(i));
    tree_.spheres.push_back(fit(begin, end, box.center()));
    if (end - begin > kLeafPoints) {
      const std::uint32_t middle = split(begin, end, box);
      add(begin, middle);
      add(middle, end);
    }
    tree_.spheres[self].next = static_cast<std::uint32_t>(tree_.spheres.size());
  }

  /// Divides the points from `begin` to `end` into halves along the longest axis of their bounding box.
  /// Points with equal coordinates are ordered by index.
  std::uint32_t split(std::uint32_t begin, std::uint32_t end, const Box& box) {
    Eigen::Index axis;
    box.sizes().maxCoeff(&axis);
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(tree_.order.begin() + begin, tree_.order.begin() + middle, tree_.order.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) {
                       return points_[a][axis] != points_[b][axis] ? points_[a][axis] < points_[b][axis] : a < b;
                     });
    return middle;
  }

  /// Approximates the smallest enclosing sphere of the points. The sphere's centre moves towards the farthest
  /// point by ever smaller steps (Bădoiu, Clarkson 2003), and the best of its positions is kept.
  Sphere fit(std::uint32_t begin, std::uint32_t end, Vector3 center) const {
    Sphere best{center, std::numeric_limits<double>::infinity(), begin, end, 0};
    for (int step = 2; step < kFitSteps + 2; ++step) {
      const std::uint32_t farthest = farthestFrom(center, begin, end);
      const double radius = (point(farthest) - center).norm();
      if (radius < best.radius) {
        best.center = center;
        best.radius = radius;
      }
      center += (point(farthest) - center) / step;
    }
    best.radius *= 1 + 8 * std::numeric_limits<double>::epsilon();
    return best;
  }

  std::uint32_t farthestFrom(const Vector3& center, std::uint32_t begin, std::uint32_t end) const {
    std::uint32_t farthest = begin;
    double most = -1;
    for (std::uint32_t i = begin; i < end; ++i) {
      const double square = (point(i) - center).squaredNorm();
      if (square > most) {
        most = square;
        farthest = i;
      }
    }
    return farthest;
  }

  const Vector3& point(std::uint32_t position) const { return points_[tree_.order[position]]; }

  std::span<const Vector3> points_;
  SphereTree tree_;
};

}  // namespace

SphereTree buildSphereTree(std::span<const Vector3> points) { return Builder(points).build(); }

}  // namespace hpsdf::physics
