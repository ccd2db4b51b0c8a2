#pragma once
// The tree structure of a bounding-volume hierarchy: which triangles belong to each node, before any boxes are fitted.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::bvh {

constexpr int kWidth = 4;  ///< maximum number of children of a node and of triangles in a block

/// Axis-aligned box. Each corner is a vector of four floats; the fourth float is unused. A new box is empty.
struct FloatBox {
  Eigen::Array4f lower = Eigen::Array4f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Array4f upper = Eigen::Array4f::Constant(-std::numeric_limits<float>::infinity());

  void extend(const FloatBox& other) {
    lower = lower.min(other.lower);
    upper = upper.max(other.upper);
  }
  void extend(const Eigen::Array4f& point) {
    lower = lower.min(point);
    upper = upper.max(point);
  }
  /// Returns half of the box's surface area, for the surface-area heuristic.
  float area() const {
    const Eigen::Array4f size = upper - lower;
    return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
  }
};

/// A node with up to four children. Each child covers a range of `TriangleTree::order` and is a node or a block
/// of triangles.
struct Branch {
  struct Child {
    std::uint32_t begin = 0, end = 0;  ///< `begin` is a multiple of kWidth
    std::unique_ptr<Branch> branch;    ///< null for a block
  };
  std::array<Child, kWidth> children;
  int count = 0;  ///< number of children in use; the range of each begins where the previous one ends
};

struct TriangleTree {
  std::unique_ptr<Branch> root;
  std::vector<std::uint32_t> order;  ///< triangle indices, sorted so that the triangles below each node are contiguous
};

/// Builds the tree of triangles with the vertices `points`. The coordinates of the vertices have magnitudes of
/// about 1; the fourth component is 0. All blocks but the last one have kWidth triangles, so that block b begins at the
/// position kWidth·b of the order. No input makes the tree deeper than 64 levels. The result does not depend on the
/// number of threads.
TriangleTree makeTriangleTree(const std::vector<Eigen::Array4f>& points, const std::vector<Triangle>& triangles);

}  // namespace hpsdf::bvh
