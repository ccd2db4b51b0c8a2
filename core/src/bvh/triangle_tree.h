#pragma once
// The topology of a bounding-volume hierarchy: the triangles below each node, before boxes are fitted to them.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace hpsdf::bvh {

constexpr int kWidth = 4;  ///< children of a node, triangles of a block

/// A node with up to four children. Each child covers a range of `TriangleTree::order` and is a node itself or a block.
struct Branch {
  struct Child {
    std::uint32_t begin = 0, end = 0;
    std::unique_ptr<Branch> branch;  ///< null for a block of at most kWidth triangles
  };
  std::array<Child, kWidth> children;
  int count = 0;  ///< number of children in use, whose ranges are adjacent
};

struct TriangleTree {
  std::unique_ptr<Branch> root;
  std::vector<std::uint32_t> order;  ///< triangle indices, contiguous below each branch
};

/// Builds the tree of triangles whose vertices are `points`, in coordinates of order 1 and with a fourth lane of 0. No
/// input makes the tree deeper than 64 levels, and the number of threads does not change it.
TriangleTree makeTriangleTree(const std::vector<Eigen::Array4f>& points,
                              const std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace hpsdf::bvh
