#include "distance/candidate_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "bvh/search.h"
#include "mesh/triangle_bounds.h"

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
        else if (!addBlock(child & ~bvh::kBlockBit))
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

  bool addBlock(std::uint32_t block) {
    for (std::uint32_t slot = block * bvh::kWidth; slot < hierarchy_.endOf(block); ++slot)
      if (bvh::squaredDistance(hierarchy_.frame(slot), x_) <= squaredRadius_) found_.push_back(slot);
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

/// Finds which of some triangles can be nearest to a point of a box, by dividing the box into smaller ones. Works in
/// single precision relative to the centre of the box.
class Sifter {
 public:
  Sifter(const Hierarchy& hierarchy, const Box& box, std::span<const std::uint32_t> slots, std::size_t most)
      : most_(most), halfSize_((box.sizes() / 2).cast<float>()), found_(slots.size()), corners_(slots.size()) {
    const Vector3 centre = box.center();
    for (std::size_t i = 0; i < slots.size(); ++i)
      for (int k = 0; k < 3; ++k)
        corners_[i][k] << (hierarchy.vertices()[hierarchy.triangles()[slots[i]][k]] - centre).cast<float>(), 0;
  }

  /// Returns the places, among the triangles, of those that can be nearest to a point of the box; or std::nullopt as
  /// soon as there are more than `most`.
  std::optional<TriangleList> sift() {
    kept_[kLevels + 1].resize(corners_.size());
    std::iota(kept_[kLevels + 1].begin(), kept_[kLevels + 1].end(), 0U);
    constexpr std::uint8_t kAllOctants = 0xff;
    if (!sift(Eigen::Vector3f::Zero(), kLevels, kAllOctants)) return std::nullopt;
    TriangleList list;
    for (std::uint32_t i = 0; i < found_.size(); ++i) {
      if (found_[i] == 0) continue;
      list.triangles.push_back(i);
      list.octants.push_back(found_[i]);
    }
    return list;
  }

 private:
  static constexpr int kLevels = 3;  ///< the box is divided into 8³ smaller boxes

  /// Sifts the triangles that remain from the level above for the box around `centre`, which lies in these octants of
  /// the whole box. Returns false as soon as more than `most` triangles are found.
  bool sift(const Eigen::Vector3f& centre, int level, std::uint8_t octants) {
    const float part = std::ldexp(1.0F, level - kLevels);  // size of this box relative to the whole one
    const float nearest = bound(centre, kept_[level + 1]);
    // The last term allows for the rounding of corners relative to the centre of the whole box.
    const float limit = (nearest + 2 * part * halfSize_.norm()) * (1 + kSingle) + kSingle * halfSize_.norm();
    std::vector<std::uint32_t>& kept = kept_[level];
    kept.clear();
    bool allKnown = true;
    for (std::size_t i = 0; i < kept_[level + 1].size(); ++i) {
      const std::uint32_t place = kept_[level + 1][i];
      if (lower_[i] > limit) continue;
      kept.push_back(place);
      allKnown = allKnown && (octants & ~found_[place]) == 0;
    }
    if (allKnown) return true;
    if (level == 0) return add(kept, octants);
    for (int octant = 0; octant < 8; ++octant) {
      const Eigen::Vector3f side((octant & 1) != 0 ? 1 : -1, (octant & 2) != 0 ? 1 : -1, (octant & 4) != 0 ? 1 : -1);
      const auto octantsOfPart = level == kLevels ? static_cast<std::uint8_t>(1 << octant) : octants;
      if (!sift(centre + (part / 2 * halfSize_).cwiseProduct(side), level - 1, octantsOfPart)) return false;
    }
    return true;
  }

  /// Sets `lower_` to lower bounds of the distances from a point to the triangles at `places`. Returns an upper bound
  /// of the distance to the nearest of them.
  float bound(const Eigen::Vector3f& x, const std::vector<std::uint32_t>& places) {
    Eigen::Vector4f point;
    point << x, 0;
    float nearest = std::numeric_limits<float>::infinity();
    lower_.resize(places.size());
    for (std::size_t first = 0; first < places.size(); first += mesh::TriangleChunk::kSize) {
      chunk_.count = std::min(mesh::TriangleChunk::kSize, places.size() - first);
      for (std::size_t i = 0; i < chunk_.count; ++i)
        for (int k = 0; k < 3; ++k) chunk_.setCorner(k, i, (corners_[places[first + i]][k] - point).head<3>());
      fillLastVector(chunk_);
      nearest = std::min(nearest, findBounds(chunk_));
      std::copy_n(chunk_.lower.begin(), chunk_.count, lower_.begin() + static_cast<std::ptrdiff_t>(first));
    }
    return nearest;
  }

  bool add(const std::vector<std::uint32_t>& places, std::uint8_t octants) {
    for (const std::uint32_t place : places) {
      count_ += found_[place] == 0 ? 1 : 0;
      found_[place] |= octants;
    }
    return count_ <= most_;
  }

  static constexpr float kSingle = 1e-5F;  ///< bound of relative rounding errors in single precision

  std::size_t most_, count_ = 0;
  Eigen::Vector3f halfSize_;
  std::vector<std::uint8_t> found_;                           ///< for each triangle, the octants in which it is found
  std::vector<std::array<Eigen::Vector4f, 3>> corners_;       ///< relative to the centre of the box
  std::array<std::vector<std::uint32_t>, kLevels + 2> kept_;  ///< places that remain at each level
  std::vector<float> lower_;
  mesh::TriangleChunk chunk_;
};

bool comesWithinAt(const Hierarchy& hierarchy, const Box& box, double distance, int levels) {
  const double fromCentre = bvh::distanceTo(hierarchy, box.center());
  if (fromCentre > distance + halfDiagonal(box)) return false;
  if (levels == 0 || fromCentre <= distance + (box.max() - box.min()).minCoeff() / 2) return true;
  bool comes = false;
  forEachOctant(box, [&](const Box& part) { comes = comes || comesWithinAt(hierarchy, part, distance, levels - 1); });
  return comes;
}

}  // namespace

bool CandidateSearch::comesWithin(const Box& box, double distance) const {
  constexpr int kLevels = 2;
  return comesWithinAt(hierarchy_, box, distance + offset_, kLevels);
}

std::optional<LeafSign> CandidateSearch::signIn(const Box& box, std::span<const std::uint32_t> triangles) const {
  return signs_.find(
      box, [&] { return comesWithin(box, -offset_); }, triangles);
}

std::optional<TriangleList> CandidateSearch::nearestTo(const Box& box, std::size_t most) const {
  // The balls around whole boxes reach about so many times more triangles than those that are found in the end.
  constexpr std::size_t kCoarse = 32;
  const double radius = halfDiagonal(box);
  const double reach = (bvh::distanceTo(hierarchy_, box.center()) + 2 * radius) * (1 + kRounding);
  const auto coarse = Collector(hierarchy_, box.center(), reach, kCoarse * most).collect();
  if (!coarse) return std::nullopt;
  auto list = Sifter(hierarchy_, box, *coarse, most).sift();
  if (!list) return std::nullopt;
  for (std::uint32_t& triangle : list->triangles) triangle = (*coarse)[triangle];
  return list;
}

}  // namespace hpsdf::distance
