#include "parts/division.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace hpsdf::parts {

Division::Division(const Box& box)
    : box_(box), counts_(std::size_t{kCells} * kCells * kCells), partOf_(counts_.size()) {
  for (int axis = 0; axis < 3; ++axis) {
    const double size = box.sizes()[axis];
    constexpr double kThinnest = 1e-290;  // so that the quotient is finite
    perUnit_[axis] = size > kThinnest ? kCells / size : 0;
  }
}

Division::Index Division::indexAt(const Vector3& x) const {
  const Vector3 place = (x - box_.min()).cwiseProduct(perUnit_);
  return place.array().max(0).min(kCells - 1).cast<int>();
}

std::size_t Division::divide(std::size_t most) {
  divide(Index::Zero(), Index::Constant(kCells), most);
  return parts_;
}

void Division::divide(const Index& low, const Index& high, std::size_t most) {
  // Count the triangles in each layer of cells, along each axis.
  std::array<std::array<std::size_t, kCells>, 3> layers{};
  std::size_t total = 0;
  const auto forEach = [&](const auto& visit) {
    for (int z = low[2]; z < high[2]; ++z)
      for (int y = low[1]; y < high[1]; ++y)
        for (int x = low[0]; x < high[0]; ++x) visit(Index(x, y, z));
  };
  forEach([&](const Index& cell) {
    const std::size_t count = counts_[numberOf(cell)];
    total += count;
    for (std::size_t axis = 0; axis < 3; ++axis) layers[axis][std::size_t(cell[Eigen::Index(axis)])] += count;
  });
  if (total == 0) return;

  // Cut the longest side for which a cut leaves triangles on both sides, where these are as equally many as possible.
  std::array<int, 3> axes = {0, 1, 2};
  std::ranges::sort(axes, [&](int a, int b) {
    const auto lengthOf = [&](int axis) { return double(high[axis] - low[axis]) * box_.sizes()[axis]; };
    return std::pair(-lengthOf(a), a) < std::pair(-lengthOf(b), b);
  });
  if (total > most)
    for (const int axis : axes) {
      std::size_t below = 0, bestDifference = total;
      int cut = 0;
      for (int layer = low[axis]; layer + 1 < high[axis]; ++layer) {
        below += layers[std::size_t(axis)][std::size_t(layer)];
        const std::size_t above = total - below, difference = std::max(below, above) - std::min(below, above);
        if (difference < bestDifference) bestDifference = difference, cut = layer + 1;
      }
      if (cut == 0) continue;
      Index middleHigh = high, middleLow = low;
      middleHigh[axis] = middleLow[axis] = cut;
      divide(low, middleHigh, most);
      divide(middleLow, high, most);
      return;
    }
  forEach([&](const Index& cell) { partOf_[numberOf(cell)] = parts_; });
  ++parts_;
}

void Division::setBoxes(std::vector<Box> boxes) {
  boxes_ = std::move(boxes);
  lastMet_.assign(boxes_.size(), 0);
  firstOfCell_.assign(counts_.size() + 1, 0);
  for (const Box& box : boxes_) forEachCell(box, [&](std::size_t cell) { ++firstOfCell_[cell + 1]; });
  std::partial_sum(firstOfCell_.begin(), firstOfCell_.end(), firstOfCell_.begin());
  partsOfCells_.resize(firstOfCell_.back());
  std::vector<std::size_t> next(firstOfCell_.begin(), firstOfCell_.end() - 1);
  for (std::uint32_t part = 0; part < boxes_.size(); ++part)
    forEachCell(boxes_[part], [&](std::size_t cell) { partsOfCells_[next[cell]++] = part; });
}

}  // namespace hpsdf::parts
