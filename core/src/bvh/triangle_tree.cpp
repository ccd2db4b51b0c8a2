#include "bvh/triangle_tree.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace hpsdf::bvh {
namespace {

constexpr std::uint32_t kLeafSize = kWidth;
constexpr int kBins = 16;
constexpr float kNarrowest = 1e-30f;  ///< least extent of the triangle centers along an axis for a division into bins

/// From this level of the tree on, a range of triangles is split into two halves of equal count. As a range has
/// at most 2^32 triangles, no input makes the tree deeper than kMaxLevel + 32 levels.
constexpr int kMaxLevel = 32;

constexpr std::uint32_t kSamples = 1024;                              ///< upper limit of triangles sampled per split
constexpr float kEmptyCost = std::numeric_limits<float>::infinity();  ///< cost of a part without triangles
constexpr std::uint32_t kParallel = 4096;  ///< number of triangles above which the children are built in parallel

/// The bounding box of a triangle and the triangle's index.
struct Item {
  FloatBox box;
  std::uint32_t triangle;

  Eigen::Array4f doubledCenter() const { return box.lower + box.upper; }
};

/// A range of triangles with two boxes: the bounding box of the triangles, and the bounding box of the doubled centers
/// of the triangles' own boxes.
struct Range {
  std::uint32_t begin = 0, end = 0;
  FloatBox box = {};
  FloatBox centers = {};

  std::uint32_t size() const { return end - begin; }
  void extend(const Item& item) {
    box.extend(item.box);
    centers.extend(item.doubledCenter());
  }
};

/// Maps the centers of a range of triangles to bin coordinates from 0 to `count` along each axis.
struct Bins {
  explicit Bins(const Range& range)
      : count(static_cast<int>(std::clamp<std::uint32_t>(range.size() / 2, 4, kBins))), origin(range.centers.lower) {
    const Eigen::Array4f extent = range.centers.upper - origin;
    perUnit = (extent > kNarrowest).select(static_cast<float>(count) / extent, 0);
  }

  Eigen::Array4f at(const Item& item) const { return (item.doubledCenter() - origin) * perUnit; }

  int count;
  Eigen::Array4f origin, perUnit;
};

/// Builds a tree top-down. The triangles of a node are split in two where the surface-area heuristic has its
/// least cost. Then the part with the largest surface area is split again, until there are four parts.
class Builder {
 public:
  explicit Builder(std::vector<Item>& items) : items_(items) {}

  std::unique_ptr<Branch> build() { return build(makeRange(0, static_cast<std::uint32_t>(items_.size())), 0); }

 private:
  Range makeRange(std::uint32_t begin, std::uint32_t end) const {
    Range range{begin, end};
    for (std::uint32_t i = begin; i < end; ++i) range.extend(items_[i]);
    return range;
  }

  std::unique_ptr<Branch> build(const Range& whole, int level) {
    auto branch = std::make_unique<Branch>();
    std::array<Range, kWidth> ranges;
    ranges[0] = whole;
    branch->count = divide(ranges, level);
    const auto buildPart = [&](int i) {
      Branch::Child& child = branch->children[i];
      child.begin = ranges[i].begin;
      child.end = ranges[i].end;
      if (ranges[i].size() > kLeafSize) child.branch = build(ranges[i], level + 1);
    };
    if (whole.size() > kParallel)
      tbb::parallel_for(0, branch->count, buildPart);
    else
      for (int i = 0; i < branch->count; ++i) buildPart(i);
    return branch;
  }

  /// Divides `parts[0]` into up to kWidth parts and returns their number.
  int divide(std::array<Range, kWidth>& parts, int level) {
    int count = 1;
    while (count < kWidth) {
      int largest = -1;
      for (int i = 0; i < count; ++i)
        if (parts[i].size() > kLeafSize && (largest < 0 || parts[i].box.area() > parts[largest].box.area()))
          largest = i;
      if (largest < 0) break;
      const auto [below, above] = split(parts[largest], level);
      std::move_backward(parts.begin() + largest + 1, parts.begin() + count, parts.begin() + count + 1);
      parts[largest] = below;
      parts[largest + 1] = above;
      ++count;
    }
    return count;
  }

  std::pair<Range, Range> split(const Range& range, int level) {
    const Eigen::Array4f extent = range.centers.upper - range.centers.lower;
    int widest = 0;
    extent.head<3>().maxCoeff(&widest);
    if (level >= kMaxLevel || !(extent[widest] > kNarrowest)) return splitByCount(range, widest);
    const Bins bins(range);
    const auto [axis, cut] = bestCut(range, bins);
    if (cut == 0) return splitByCount(range, widest);
    return partition(range,
                     [&, a = axis, c = static_cast<float>(cut)](const Item& item) { return bins.at(item)[a] < c; });
  }

  template <typename IsBelow>
  std::pair<Range, Range> partition(const Range& range, const IsBelow& isBelow) {
    Range below{range.begin, range.begin}, above{range.end, range.end};
    while (below.end < above.begin) {
      Item& item = items_[below.end];
      if (isBelow(item)) {
        below.extend(item);
        ++below.end;
      } else {
        above.extend(item);
        --above.begin;
        std::swap(item, items_[above.begin]);
      }
    }
    return {below, above};
  }

  struct Bin {
    FloatBox box;
    std::uint32_t count = 0;

    void extend(const Bin& other) {
      box.extend(other.box);
      count += other.count;
    }
    float cost() const { return count > 0 ? box.area() * static_cast<float>(count) : kEmptyCost; }
  };

  /// Returns the axis of the split with the least cost, and the first bin above the split. The bin is 0 if all
  /// centers share one bin.
  std::pair<int, int> bestCut(const Range& range, const Bins& bins) const {
    Bin filled[3][kBins];
    const std::uint32_t step = 1 + range.size() / kSamples;
    for (std::uint32_t i = range.begin; i < range.end; i += step) {
      const Eigen::Array4i bin = bins.at(items_[i]).cast<int>().min(bins.count - 1).max(0);
      for (int axis = 0; axis < 3; ++axis) {
        filled[axis][bin[axis]].box.extend(items_[i].box);
        ++filled[axis][bin[axis]].count;
      }
    }
    std::pair<int, int> best{0, 0};
    float bestCost = std::numeric_limits<float>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      if (bins.perUnit[axis] == 0) continue;
      std::array<float, kBins> above;  // for each bin, the cost of an upper part that begins there
      Bin part;
      for (int bin = bins.count - 1; bin > 0; --bin) {
        part.extend(filled[axis][bin]);
        above[bin] = part.cost();
      }
      part = Bin();
      for (int bin = 1; bin < bins.count; ++bin) {
        part.extend(filled[axis][bin - 1]);
        const float cost = part.cost() + above[bin];
        if (cost < bestCost) bestCost = cost, best = {axis, bin};
      }
    }
    return best;
  }

  std::pair<Range, Range> splitByCount(const Range& range, int axis) {
    const std::uint32_t middle = range.begin + range.size() / 2;
    const auto key = [axis](const Item& item) { return std::pair(item.doubledCenter()[axis], item.triangle); };
    std::nth_element(items_.begin() + range.begin, items_.begin() + middle, items_.begin() + range.end,
                     [&](const Item& a, const Item& b) { return key(a) < key(b); });
    return {makeRange(range.begin, middle), makeRange(middle, range.end)};
  }

  std::vector<Item>& items_;
};

}  // namespace

TriangleTree makeTriangleTree(const std::vector<Eigen::Array4f>& points, const std::vector<Triangle>& triangles) {
  std::vector<Item> items(triangles.size());
  tbb::parallel_for(std::size_t{0}, items.size(), [&](std::size_t t) {
    items[t].triangle = static_cast<std::uint32_t>(t);
    for (const std::uint32_t vertex : triangles[t]) items[t].box.extend(points[vertex]);
  });
  TriangleTree tree{Builder(items).build(), std::vector<std::uint32_t>(items.size())};
  tbb::parallel_for(std::size_t{0}, items.size(), [&](std::size_t slot) { tree.order[slot] = items[slot].triangle; });
  return tree;
}

}  // namespace hpsdf::bvh
