#include "contour/cells/contour_octree.h"

#include <cmath>

namespace hpsdf::contouring {

namespace {

constexpr std::int32_t kRootSize = std::int32_t{1} << ContourOctree::kDepth;

}  // namespace

ContourOctree::ContourOctree(const Box& domain, double rootEdge) : unit_(std::ldexp(rootEdge, -kDepth)) {
  const Vector3 shift = Vector3(0.29361, 0.41877, 0.37129) * rootEdge;
  origin_ = domain.min() - shift;
  for (int axis = 0; axis < 3; ++axis)
    roots_[axis] = static_cast<std::int32_t>((domain.sizes()[axis] + shift[axis]) / rootEdge) + 1;
  for (std::int32_t z = 0; z < roots_[2]; ++z)
    for (std::int32_t y = 0; y < roots_[1]; ++y)
      for (std::int32_t x = 0; x < roots_[0]; ++x)
        cells_.push_back({{x * kRootSize, y * kRootSize, z * kRootSize}, kRootSize});
}

void ContourOctree::divide(std::span<const std::int32_t> leaves) {
  cells_.reserve(cells_.size() + 8 * leaves.size());
  for (const std::int32_t leaf : leaves) {
    ContourCell& parent = cells_[static_cast<std::size_t>(leaf)];
    parent.child = static_cast<std::int32_t>(cells_.size());
    const std::int32_t half = parent.size / 2;
    for (int n = 0; n < 8; ++n) {
      GridPoint lower = parent.lower;
      for (int axis = 0; axis < 3; ++axis) lower[axis] += (n >> axis & 1) * half;
      cells_.push_back({lower, half});
    }
  }
}

std::int32_t ContourOctree::leafAt(const GridPoint& point) const {
  std::array<std::int32_t, 3> root;
  for (int axis = 0; axis < 3; ++axis) {
    root[axis] = point[axis] >> kDepth;
    if (root[axis] < 0 || root[axis] >= roots_[axis]) return -1;
  }
  std::int32_t cell = (root[2] * roots_[1] + root[1]) * roots_[0] + root[0];
  while (!(*this)[cell].isLeaf()) {
    const std::int32_t half = (*this)[cell].size / 2;
    int n = 0;
    for (int axis = 0; axis < 3; ++axis) n |= ((point[axis] & half) != 0) << axis;
    cell = (*this)[cell].child + n;
  }
  return cell;
}

Box ContourOctree::box(const ContourCell& cell) const {
  GridPoint upper = cell.lower;
  for (std::int32_t& coordinate : upper) coordinate += cell.size;
  return Box(position(cell.lower), position(upper));
}

}  // namespace hpsdf::contouring
