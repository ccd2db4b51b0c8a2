#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "distance/triangle_frame.h"
#include "hpsdf/types.h"

namespace hpsdf::distance {

/// The nearest triangle so far: its place in hierarchy order, its squared distance, its index in the mesh.
struct Nearest {
  std::uint32_t slot = 0;
  double squaredDistance = std::numeric_limits<double>::infinity();
  std::uint32_t triangle = std::numeric_limits<std::uint32_t>::max();
};

/// Four-wide hierarchy of axis-aligned boxes over triangles.
///
/// Boxes only decide what to skip: they are kept as float, rounded outwards, in coordinates that put the mesh into
/// [-1, 1]³, so that one node is two cache lines and its four boxes are one vector a plane. Distances to triangles are
/// double. The answer is the minimum by (computed squared distance, mesh index) over *all* triangles: skipping allows
/// for every rounding, hence the answer depends neither on the tree nor on where a search started.
class Hierarchy {
 public:
  /// At least one triangle, all coordinates finite; at most `kMaxTriangles`.
  explicit Hierarchy(std::vector<TriangleFrame> triangles);

  static constexpr std::size_t kMaxTriangles = std::size_t{1} << 28;

  /// Nearest triangle of x. `start`, if it is one of ours, bounds the search from the outset.
  Nearest nearest(const Vector3& x) const { return search(x, Nearest{}); }
  Nearest nearest(const Vector3& x, std::uint32_t start) const {
    const TriangleFrame& frame = triangles_[start];
    return search(x, {start, squaredDistance(frame, x), frame.triangle});
  }

  /// In hierarchy order: `slot` counts these.
  const std::vector<TriangleFrame>& triangles() const { return triangles_; }

  std::size_t bytes() const { return triangles_.size() * sizeof(TriangleFrame) + nodes_.size() * sizeof(Node); }

 private:
  struct Node {
    std::array<Eigen::Array4f, 3> lower;  ///< an axis: that bound of the four children
    std::array<Eigen::Array4f, 3> upper;
    std::array<std::uint32_t, 4> child;
  };
  class Builder;

  Nearest search(const Vector3& x, Nearest best) const;

  std::vector<TriangleFrame> triangles_;
  std::vector<Node> nodes_;
  Vector3 center_;    ///< box coordinates = (x - center_)·scale_
  double scale_ = 1;  ///< 1/half of the longest side of the mesh's box
};

}  // namespace hpsdf::distance
