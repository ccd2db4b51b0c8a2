#include "bvh/triangle_tree.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

namespace hpsdf::bvh {
namespace {

constexpr std::uint32_t kBlockSize = kWidth;
constexpr std::uint32_t kFew = 32;  ///< number of triangles up to which all divisions into blocks are compared
constexpr int kBins = 16;
constexpr float kNarrowest = 1e-30f;  ///< least extent of the triangle centers along an axis for a division into bins

/// From this level of the tree on, a range of more than kFew triangles is split into two halves of about equal count.
/// As a range has at most 2^32 triangles, no input makes the tree deeper than kMaxLevel + 32 levels.
constexpr int kMaxLevel = 32;

constexpr std::uint32_t kSamples = 1024;                              ///< upper limit of triangles sampled per split
constexpr float kEmptyCost = std::numeric_limits<float>::infinity();  ///< cost of a part without triangles
constexpr std::uint32_t kParallel = 4096;  ///< number of triangles above which the children are built in parallel

/// The bounding box of a triangle and the triangle's index.
struct Item {
  FloatBox box;
  std::uint32_t triangle;

  Eigen::Array4f doubledCenter() const { return box.lower + box.upper; }
  /// Returns the sort key along an axis. It differs from those of all other triangles.
  std::pair<float, std::uint32_t> key(int axis) const { return {box.lower[axis] + box.upper[axis], triangle}; }
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

std::uint32_t blocksOf(std::uint32_t triangles) { return (triangles + kBlockSize - 1) / kBlockSize; }

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
/// least cost. Then parts are split again until there are four, mostly the one with the largest surface area. The lower
/// part of every split fills its blocks.
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
      if (ranges[i].size() > kBlockSize) child.branch = build(ranges[i], level + 1);
    };
    if (whole.size() > kParallel)
      tbb::parallel_for(0, branch->count, buildPart);
    else
      for (int i = 0; i < branch->count; ++i) buildPart(i);
    return branch;
  }

  /// Returns the key by which the next part to be split is chosen, the greatest first: a part of two blocks, which then
  /// needs no node of its own; then others by their surface area; last of all a part of four blocks, which fills a
  /// node.
  static std::pair<int, float> precedenceOf(const Range& part) {
    const std::uint32_t blocks = blocksOf(part.size());
    return {blocks == 2 ? 1 : blocks == kWidth ? -1 : 0, part.box.area()};
  }

  /// Divides `parts[0]` into up to kWidth parts and returns their number.
  int divide(std::array<Range, kWidth>& parts, int level) {
    int count = 1;
    while (count < kWidth) {
      int next = -1;
      for (int i = 0; i < count; ++i)
        if (parts[i].size() > kBlockSize && (next < 0 || precedenceOf(parts[i]) > precedenceOf(parts[next]))) next = i;
      if (next < 0) break;
      const auto [below, above] = split(parts[next], level);
      std::move_backward(parts.begin() + next + 1, parts.begin() + count, parts.begin() + count + 1);
      parts[next] = below;
      parts[next + 1] = above;
      ++count;
    }
    return count;
  }

  std::pair<Range, Range> split(const Range& range, int level) {
    if (range.size() <= kFew) return splitFew(range);
    const Eigen::Array4f extent = range.centers.upper - range.centers.lower;
    int widest = 0;
    extent.head<3>().maxCoeff(&widest);
    if (level >= kMaxLevel || !(extent[widest] > kNarrowest)) return splitByCount(range, widest);
    const Bins bins(range);
    const auto [axis, cut] = bestCut(range, bins);
    if (cut == 0) return splitByCount(range, widest);
    auto [below, above] =
        partition(range, [&, a = axis, c = static_cast<float>(cut)](const Item& item) { return bins.at(item)[a] < c; });
    fillBlocks(below, above, axis);
    return {below, above};
  }

  /// Moves up to three triangles between the parts of a split along an axis, so that the lower part fills its blocks.
  /// A box from which triangles are moved is not made smaller: the boxes serve only to find good splits.
  void fillBlocks(Range& below, Range& above, int axis) {
    const std::uint32_t over = below.size() % kBlockSize, missing = kBlockSize - over;
    if (over == 0) return;
    const auto lower = [&](const Item& a, const Item& b) { return a.key(axis) < b.key(axis); };
    const auto at = [&](std::uint32_t place) { return items_.begin() + place; };
    if (below.size() < kBlockSize || (missing < over && missing < above.size())) {
      for (std::uint32_t i = 0; i < missing; ++i) {
        std::iter_swap(std::min_element(at(above.begin), at(above.end), lower), at(above.begin));
        below.extend(items_[above.begin]);
        below.end = ++above.begin;
      }
    } else {
      for (std::uint32_t i = 0; i < over; ++i) {
        std::iter_swap(std::max_element(at(below.begin), at(below.end), lower), at(below.end - 1));
        above.extend(items_[below.end - 1]);
        above.begin = --below.end;
      }
    }
  }

  /// Splits at most kFew triangles, sorted by their centers along one of the axes, between two blocks: of all such
  /// splits, at the one with the least cost.
  std::pair<Range, Range> splitFew(const Range& range) {
    using Places = std::array<std::uint8_t, kFew>;
    const std::span<Item> items(items_.data() + range.begin, range.size());
    Places best{};
    std::uint32_t bestCut = kBlockSize;
    float bestCost = std::numeric_limits<float>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      Places places{};
      const auto end = places.begin() + std::ptrdiff_t(items.size());
      std::iota(places.begin(), end, std::uint8_t{0});
      std::sort(places.begin(), end,
                [&](std::uint8_t a, std::uint8_t b) { return items[a].key(axis) < items[b].key(axis); });
      std::array<float, kFew + 1> above;  // for each number of triangles in the lower part, the cost of the upper part
      FloatBox box;
      for (auto i = std::uint32_t(items.size()); i-- > kBlockSize;) {
        box.extend(items[places[i]].box);
        above[i] = costOf(box, std::uint32_t(items.size()) - i);
      }
      box = FloatBox();
      for (std::uint32_t i = 0; i + 1 < items.size(); ++i) {
        box.extend(items[places[i]].box);
        const std::uint32_t cut = i + 1;
        if (cut % kBlockSize != 0) continue;
        const float cost = costOf(box, cut) + above[cut];
        if (cost < bestCost || bestCost == std::numeric_limits<float>::infinity())
          bestCost = cost, best = places, bestCut = cut;
      }
    }
    std::array<Item, kFew> sorted;
    for (std::size_t i = 0; i < items.size(); ++i) sorted[i] = items[best[i]];
    std::copy_n(sorted.begin(), items.size(), items.begin());
    const std::uint32_t middle = range.begin + bestCut;
    return {makeRange(range.begin, middle), makeRange(middle, range.end)};
  }

  /// Returns the cost of visiting a part: its surface area times the number of its blocks and of the nodes that they
  /// need at least. A node counts twice, which leaves few nodes unfilled.
  static float costOf(const FloatBox& box, std::uint32_t count) {
    const std::uint32_t blocks = blocksOf(count), nodes = (blocks + 1) / (kWidth - 1);
    return box.area() * static_cast<float>(blocks + 2 * nodes);
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
    const std::uint32_t middle = range.begin + blocksOf(range.size()) / 2 * kBlockSize;
    std::nth_element(items_.begin() + range.begin, items_.begin() + middle, items_.begin() + range.end,
                     [&](const Item& a, const Item& b) { return a.key(axis) < b.key(axis); });
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
