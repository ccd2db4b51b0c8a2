#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bvh/hierarchy.h"
#include "distance/exact_leaf_signs.h"
#include "hpsdf/detail/triangle_search.h"

namespace hpsdf::distance {

/// The search for candidate triangles in a hierarchy.
///
/// For a ball with the centre c and the radius r, no triangle farther from c than d(c) + 2r can be nearest to a point
/// of the ball, where d(c) is the distance from c to the nearest triangle. The search covers a box by 8³ balls.
class CandidateSearch final : public TriangleSearch {
 public:
  /// Keeps references to the hierarchy and the signs.
  CandidateSearch(const bvh::Hierarchy& hierarchy, const ExactLeafSigns& signs, double offset)
      : hierarchy_(hierarchy), signs_(signs), offset_(offset) {}

  std::span<const Vector3> vertices() const override { return hierarchy_.vertices(); }
  std::span<const std::array<std::uint32_t, 3>> triangles() const override { return hierarchy_.triangles(); }
  double offset() const override { return offset_; }
  bool comesWithin(const Box& box, double distance) const override;
  std::optional<TriangleList> nearestTo(const Box& box, std::size_t most) const override;
  bool hasSigns() const override { return signs_.any(); }
  std::optional<LeafSign> signIn(const Box& box, std::span<const std::uint32_t> triangles) const override;

 private:
  const bvh::Hierarchy& hierarchy_;
  const ExactLeafSigns& signs_;
  double offset_;
};

}  // namespace hpsdf::distance
