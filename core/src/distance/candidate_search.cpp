#include "distance/candidate_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bvh/search.h"

namespace hpsdf::distance {
namespace {

using bvh::Hierarchy;

/// Bound of the relative rounding error of a distance that is computed in double precision.
constexpr double kRounding = 1e-13;

/// Calls f(child) for the eight parts of a box.
template <typename F>
void forEachOctant(const Box& box, const F& f) {
  const Vector3 centre = box.center();
  for (int octant = 0; octant < 8; ++octant) {
    Box part;
    for (int axis = 0; axis < 3; ++axis) {
      const bool upper = (octant >> axis & 1) != 0;
      part.min()[axis] = upper ? centre[axis] : box.min()[axis];
      part.max()[axis] = upper ? box.max()[axis] : centre[axis];
    }
    f(part);
  }
}

double halfDiagonal(const Box& box) { return (box.max() - box.min()).norm() / 2; }

double distanceTo(const Hierarchy& hierarchy, const Vector3& x) {
  const bvh::Nearest nearest = bvh::nearestTriangle(hierarchy, x);
  return std::sqrt(bvh::squaredDistance(hierarchy.frameAt(nearest.triangleRef), x));
}

/// Collects the triangles within a radius of a point.
class Collector {
 public:
  Collector(const Hierarchy& hierarchy, const Vector3& x, double radius, std::size_t most)
      : hierarchy_(hierarchy), x_(x), squaredRadius_(radius * radius), most_(most) {
    const Vector3 local = hierarchy.local(x);
    local_ = local.cast<float>();
    const double largest = std::max(1.0, local.cwiseAbs().maxCoeff());
    const double reach = radius * hierarchy.scale() + 32 * std::numeric_limits<float>::epsilon() * largest;
    squaredReach_ = static_cast<float>(reach * reach * (1 + 1e-5));
  }

  /// Returns std::nullopt if more than `most` triangles are found.
  std::optional<std::vector<std::uint32_t>> collect() {
    std::vector<std::uint32_t> stack = {0};
    while (!stack.empty()) {
      const bvh::Node& node = hierarchy_.nodes()[stack.back()];
      stack.pop_back();
      for (int lane = 0; lane < bvh::kWidth; ++lane) {
        const std::uint32_t child = node.child[lane];
        if (child == bvh::kEmpty || squaredDistanceToBox(node, lane) > squaredReach_) continue;
        if ((child & bvh::kBlockBit) == 0)
          stack.push_back(child);
        else if (!addBlock(hierarchy_.blocks()[child & ~bvh::kBlockBit]))
          return std::nullopt;
      }
    }
    std::ranges::sort(found_);
    return std::move(found_);
  }

 private:
  float squaredDistanceToBox(const bvh::Node& node, int lane) const {
    const auto field = [&](int index) { return node.field[index][lane]; };
    float w[3], sum = 0;
    for (int i = 0; i < 3; ++i) w[i] = local_[i] - field(bvh::Node::center + i);
    for (int axis = 0; axis < 3; ++axis) {
      const int a = bvh::Node::axes + 3 * axis;
      const float along = w[0] * field(a) + w[1] * field(a + 1) + w[2] * field(a + 2);
      const float beyond = std::max(std::abs(along) - field(bvh::Node::half + axis), 0.0F);
      sum += beyond * beyond;
    }
    return sum;
  }

  bool addBlock(const bvh::Block& block) {
    for (std::uint32_t slot = block.first; slot < block.first + block.count; ++slot)
      if (bvh::squaredDistance(hierarchy_.frames()[slot], x_) <= squaredRadius_) found_.push_back(slot);
    return found_.size() <= most_;
  }

  const Hierarchy& hierarchy_;
  Vector3 x_;
  double squaredRadius_;
  std::size_t most_;
  Eigen::Vector3f local_;
  float squaredReach_;
  std::vector<std::uint32_t> found_;
};

/// Finds which of some triangles can be nearest to a point of a box, by dividing the box into smaller ones.
class Sifter {
 public:
  Sifter(const Hierarchy& hierarchy, std::size_t most) : hierarchy_(hierarchy), most_(most) {}

  /// Adds the triangles that can be nearest to a point of `box` to the result. Returns false as soon as the result has
  /// more than `most` triangles.
  bool sift(const Box& box, std::span<const std::uint32_t> triangles, int levels) {
    const Vector3 centre = box.center();
    std::vector<double> distances(triangles.size());
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      distances[i] = std::sqrt(bvh::squaredDistance(hierarchy_.frames()[triangles[i]], centre));
      nearest = std::min(nearest, distances[i]);
    }
    const double radius = halfDiagonal(box);
    const double limit = (nearest + 2 * radius) * (1 + kRounding);
    std::vector<std::uint32_t> kept;
    bool allKnown = true;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      if (distances[i] > limit) continue;
      kept.push_back(triangles[i]);
      allKnown = allKnown && std::ranges::binary_search(found_, triangles[i]);
    }
    if (allKnown) return true;
    if (levels == 0) return add(kept);
    bool fits = true;
    forEachOctant(box, [&](const Box& part) { fits = fits && sift(part, kept, levels - 1); });
    return fits;
  }

  std::vector<std::uint32_t>& found() { return found_; }

 private:
  bool add(const std::vector<std::uint32_t>& triangles) {
    std::vector<std::uint32_t> merged;
    std::ranges::set_union(found_, triangles, std::back_inserter(merged));
    found_ = std::move(merged);
    return found_.size() <= most_;
  }

  const Hierarchy& hierarchy_;
  std::size_t most_;
  std::vector<std::uint32_t> found_;  ///< in ascending order
};

bool comesWithinAt(const Hierarchy& hierarchy, const Box& box, double distance, int levels) {
  const double fromCentre = distanceTo(hierarchy, box.center());
  if (fromCentre > distance + halfDiagonal(box)) return false;
  if (levels == 0 || fromCentre <= distance + (box.max() - box.min()).minCoeff() / 2) return true;
  bool comes = false;
  forEachOctant(box, [&](const Box& part) { comes = comes || comesWithinAt(hierarchy, part, distance, levels - 1); });
  return comes;
}

}  // namespace

bool CandidateSearch::comesWithin(const Box& box, double distance) const {
  constexpr int kLevels = 2;
  return comesWithinAt(*hierarchy_, box, distance + offset_, kLevels);
}

std::optional<std::vector<std::uint32_t>> CandidateSearch::nearestTo(const Box& box, std::size_t most) const {
  constexpr int kLevels = 3;
  // The balls around whole boxes reach about so many times more triangles than those that are found in the end.
  constexpr std::size_t kCoarse = 32;
  const double radius = halfDiagonal(box);
  const double reach = (distanceTo(*hierarchy_, box.center()) + 2 * radius) * (1 + kRounding);
  const auto coarse = Collector(*hierarchy_, box.center(), reach, kCoarse * most).collect();
  if (!coarse) return std::nullopt;
  Sifter sifter(*hierarchy_, most);
  if (!sifter.sift(box, *coarse, kLevels)) return std::nullopt;
  return std::move(sifter.found());
}

}  // namespace hpsdf::distance
