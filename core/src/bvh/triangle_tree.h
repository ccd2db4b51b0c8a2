#pragma once
// The shape of a hierarchy, before there are boxes: which triangles lie below which node.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace hpsdf::distance {

constexpr int kWidth = 4;  ///< children of a node, triangles of a block

/// A node's children: ranges of the tree's order, each of them divided further or a block's triangles.
struct Branch {
  struct Part {
    std::uint32_t begin = 0, end = 0;
    std::unique_ptr<Branch> branch;  ///< none: at most kWidth triangles
  };
  std::array<Part, kWidth> parts;
  int count = 0;  ///< of the parts; they follow one another
};

struct TriangleTree {
  std::unique_ptr<Branch> root;
  std::vector<std::uint32_t> order;  ///< the triangles, those below each branch side by side
};

/// `points`: the vertices, in coordinates of order 1; the fourth lane is 0. No input makes the tree deeper than 64
/// levels. The same tree for any number of threads.
TriangleTree makeTriangleTree(const std::vector<Eigen::Array4f>& points,
                              const std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace hpsdf::distance
