#include "util/morton_order.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <utility>

namespace hpsdf::detail {
namespace {

constexpr int kBitsOfAxis = 21;

/// Spreads the low 21 bits of a number to every third bit.
std::uint64_t spreadBits(std::uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  x = (x | x << 2) & 0x1249249249249249;
  return x;
}

}  // namespace

std::vector<std::uint32_t> mortonOrder(std::span<const Vector3> points, const Box& box) {
  constexpr int kCells = 1 << kBitsOfAxis;
  Vector3 scale = Vector3::Zero();
  for (int axis = 0; axis < 3; ++axis)
    if (box.sizes()[axis] > 0) scale[axis] = kCells / box.sizes()[axis];
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(points.size());
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t n) {
    const Vector3 at = (points[n] - box.min()).cwiseProduct(scale).cwiseMax(0).cwiseMin(kCells - 1);
    const auto bits = [&](int axis) { return spreadBits(static_cast<std::uint64_t>(at[axis])) << axis; };
    keys[n] = {bits(0) | bits(1) | bits(2), static_cast<std::uint32_t>(n)};
  });
  tbb::parallel_sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> order(points.size());
  std::ranges::transform(keys, order.begin(), &std::pair<std::uint64_t, std::uint32_t>::second);
  return order;
}

}  // namespace hpsdf::detail
