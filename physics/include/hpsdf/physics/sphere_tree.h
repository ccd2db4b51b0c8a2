#pragma once
// A hierarchy of bounding spheres around points.

#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf::physics {

/// A node of the hierarchy. Its sphere surrounds the points at the positions `begin` to `end` (exclusive) in
/// `SphereTree::order`. The nodes are stored in depth-first order. `next` is the index of the first node after this
/// node's subtree. A search that skips this node continues there. A node has no children if `next` is its own index
/// plus 1.
struct Sphere {
  Vector3 center;
  double radius;  ///< no point is farther from the centre, in spite of rounding
  std::uint32_t begin, end;
  std::uint32_t next;
};

struct SphereTree {
  std::vector<Sphere> spheres;       ///< the first one contains all points
  std::vector<std::uint32_t> order;  ///< indices of the points, sorted so that the points of each node are contiguous
};

/// Builds a hierarchy of bounding spheres around one or more points.
SphereTree buildSphereTree(std::span<const Vector3> points);

}  // namespace hpsdf::physics
