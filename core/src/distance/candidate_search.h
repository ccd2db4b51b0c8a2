#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "bvh/hierarchy.h"
#include "hpsdf/detail/triangle_search.h"

namespace hpsdf::distance {

/// The search for candidate triangles in a hierarchy.
///
/// For a ball with the centre c and the radius r, no triangle farther from c than d(c) + 2r can be nearest to a point of
/// the ball, where d(c) is the distance from c to the nearest triangle. The search covers a box by 8³ balls.
class CandidateSearch final : public TriangleSearch {
 public:
  using SignRule = std::function<std::optional<ExactSign>(const Box&, std::span<const std::uint32_t>)>;

  /// Keeps a pointer to the hierarchy.
  CandidateSearch(const bvh::Hierarchy& hierarchy, double offset, SignRule signRule)
      : hierarchy_(&hierarchy), offset_(offset), signRule_(std::move(signRule)) {}

  std::span<const Vector3> vertices() const override { return hierarchy_->vertices(); }
  std::span<const std::array<std::uint32_t, 3>> triangles() const override { return hierarchy_->triangles(); }
  double offset() const override { return offset_; }
  bool comesWithin(const Box& box, double distance) const override;
  std::optional<std::vector<std::uint32_t>> nearestTo(const Box& box, std::size_t most) const override;
  std::optional<ExactSign> signIn(const Box& box, std::span<const std::uint32_t> triangles) const override {
    return signRule_(box, triangles);
  }

 private:
  const bvh::Hierarchy* hierarchy_;
  double offset_;
  SignRule signRule_;
};

}  // namespace hpsdf::distance
