#include "distance/hierarchy.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hpsdf::distance {
namespace {

constexpr std::uint32_t kLeafSize = 4;
constexpr int kBins = 16;

/// Below this level nodes are halved by count, so that no input makes the tree deeper than kMaxLevel + 32 levels
/// (2^32 triangles, each level at least halves a range).
constexpr int kMaxLevel = 32;
/// A level leaves at most three children waiting.
constexpr std::size_t kStackSize = 3 * (kMaxLevel + 32) + 1;

/// A child is an empty lane, a node's index, or a leaf: bit 31, count - 1 in bits 28 to 30, first slot in the rest.
constexpr std::uint32_t kEmpty = 0x7fffffff;
constexpr std::uint32_t kLeafBit = 0x80000000;
constexpr std::uint32_t kSlotMask = 0x0fffffff;
static_assert(kLeafSize <= 8);

struct FloatBox {
  Eigen::Array4f lower = Eigen::Array4f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Array4f upper = Eigen::Array4f::Constant(-std::numeric_limits<float>::infinity());

  void extend(const FloatBox& other) {
    lower = lower.min(other.lower);
    upper = upper.max(other.upper);
  }
  float area() const {
    const Eigen::Array4f size = upper - lower;
    return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
  }
};

/// A triangle while the tree is built. The fourth lane of the box is 0.
struct Item {
  FloatBox box;
  std::uint32_t index;

  Eigen::Array4f doubledCenter() const { return box.lower + box.upper; }
};

struct Range {
  std::uint32_t begin, end;
  FloatBox box;

  std::uint32_t size() const { return end - begin; }
};

float roundedDown(double value) {
  const float rounded = static_cast<float>(value);
  return rounded > value ? std::nextafter(rounded, -std::numeric_limits<float>::infinity()) : rounded;
}

float roundedUp(double value) { return -roundedDown(-value); }

std::array<Vector3, 3> cornersOf(const TriangleFrame& f) {
  return {f.origin, f.origin + f.along * f.length, f.origin + f.along * f.apexAlong + f.across * f.apexAcross};
}

}  // namespace

/// Top-down: a node's range is split where the surface-area heuristic is least, then the child of largest area again,
/// until there are four.
class Hierarchy::Builder {
 public:
  Builder(Hierarchy& hierarchy, std::vector<Item> items) : nodes_(hierarchy.nodes_), items_(std::move(items)) {}

  void build() {
    nodes_.reserve(items_.size() / 3 + 1);
    buildNode(makeRange(0, static_cast<std::uint32_t>(items_.size())), 0);
  }

  const std::vector<Item>& items() const { return items_; }

 private:
  Range makeRange(std::uint32_t begin, std::uint32_t end) const {
    Range range{begin, end, {}};
    for (std::uint32_t i = begin; i < end; ++i) range.box.extend(items_[i].box);
    return range;
  }

  std::uint32_t buildNode(const Range& whole, int level) {
    const auto self = static_cast<std::uint32_t>(nodes_.size());
    nodes_.emplace_back();
    std::array<Range, 4> parts;
    parts[0] = whole;
    const int count = divide(parts, level);
    for (int lane = 0; lane < 4; ++lane) {
      const FloatBox box = lane < count ? parts[lane].box : FloatBox{};
      for (int axis = 0; axis < 3; ++axis) {
        nodes_[self].lower[axis][lane] = box.lower[axis];
        nodes_[self].upper[axis][lane] = box.upper[axis];
      }
      const std::uint32_t child = lane < count ? buildChild(parts[lane], level + 1) : kEmpty;
      nodes_[self].child[lane] = child;
    }
    return self;
  }

  std::uint32_t buildChild(const Range& range, int level) {
    if (range.size() <= kLeafSize) return kLeafBit | (range.size() - 1) << 28 | range.begin;
    return buildNode(range, level);
  }

  int divide(std::array<Range, 4>& parts, int level) {
    int count = 1;
    while (count < 4) {
      int largest = -1;
      for (int i = 0; i < count; ++i)
        if (parts[i].size() > kLeafSize && (largest < 0 || parts[i].box.area() > parts[largest].box.area()))
          largest = i;
      if (largest < 0) break;
      const Range range = parts[largest];
      const std::uint32_t middle = split(range, level);
      parts[largest] = makeRange(range.begin, middle);
      parts[count++] = makeRange(middle, range.end);
    }
    return count;
  }

  struct Bins {
    Eigen::Array4f origin;
    Eigen::Array4f perUnit;

    int operator()(const Item& item, int axis) const {
      const float bin = (item.doubledCenter()[axis] - origin[axis]) * perUnit[axis];
      return std::min(static_cast<int>(bin), kBins - 1);
    }
  };

  /// Where [begin, end) falls into two, its items arranged accordingly.
  std::uint32_t split(const Range& range, int level) {
    FloatBox centers;
    for (std::uint32_t i = range.begin; i < range.end; ++i) {
      const Eigen::Array4f center = items_[i].doubledCenter();
      centers.extend({center, center});
    }
    const Eigen::Array4f extent = centers.upper - centers.lower;
    int widest = 0;
    extent.head<3>().maxCoeff(&widest);
    // so close together that a bin would have no width
    if (level >= kMaxLevel || !(extent[widest] > 1e-30f)) return splitByCount(range, widest);

    const Bins bins{centers.lower, (extent > 1e-30f).select(kBins / extent, 0)};
    const auto [axis, cut] = bestCut(range, bins);
    if (cut == 0) return splitByCount(range, widest);
    const auto middle = std::partition(items_.begin() + range.begin, items_.begin() + range.end,
                                       [&, a = axis, c = cut](const Item& item) { return bins(item, a) < c; });
    return static_cast<std::uint32_t>(middle - items_.begin());
  }

  /// Axis, and the first bin of the upper part; 0 where all centers share one bin.
  std::pair<int, int> bestCut(const Range& range, const Bins& bins) const {
    std::array<std::array<FloatBox, kBins>, 3> boxes;
    std::array<std::array<std::uint32_t, kBins>, 3> counts{};
    for (std::uint32_t i = range.begin; i < range.end; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        const int bin = bins(items_[i], axis);
        boxes[axis][bin].extend(items_[i].box);
        ++counts[axis][bin];
      }
    std::pair<int, int> best{0, 0};
    float bestCost = std::numeric_limits<float>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      std::array<float, kBins> above{};  // cost of the part from a bin on
      FloatBox box;
      std::uint32_t count = 0;
      for (int bin = kBins - 1; bin > 0; --bin) {
        box.extend(boxes[axis][bin]);
        count += counts[axis][bin];
        above[bin] = count > 0 ? box.area() * static_cast<float>(count) : -1;
      }
      box = FloatBox{};
      count = 0;
      for (int bin = 1; bin < kBins && above[bin] >= 0; ++bin) {
        box.extend(boxes[axis][bin - 1]);
        count += counts[axis][bin - 1];
        if (count == 0) continue;
        const float cost = box.area() * static_cast<float>(count) + above[bin];
        if (cost < bestCost) bestCost = cost, best = {axis, bin};
      }
    }
    return best;
  }

  std::uint32_t splitByCount(const Range& range, int axis) {
    const std::uint32_t middle = range.begin + range.size() / 2;
    std::nth_element(items_.begin() + range.begin, items_.begin() + middle, items_.begin() + range.end,
                     [axis](const Item& a, const Item& b) {
                       return std::pair(a.doubledCenter()[axis], a.index) < std::pair(b.doubledCenter()[axis], b.index);
                     });
    return middle;
  }

  std::vector<Node>& nodes_;
  std::vector<Item> items_;
};

Hierarchy::Hierarchy(std::vector<TriangleFrame> triangles) {
  Box box;
  for (const TriangleFrame& frame : triangles)
    for (const Vector3& corner : cornersOf(frame)) box.extend(corner);
  center_ = box.center();
  const double half = box.sizes().maxCoeff() / 2;
  scale_ = half > 0 ? 1 / half : 1;

  std::vector<Item> items(triangles.size());
  for (std::uint32_t i = 0; i < items.size(); ++i) {
    items[i].index = i;
    for (const Vector3& corner : cornersOf(triangles[i])) {
      const Vector3 local = (corner - center_) * scale_;
      FloatBox point{Eigen::Array4f::Zero(), Eigen::Array4f::Zero()};
      for (int axis = 0; axis < 3; ++axis) {
        point.lower[axis] = roundedDown(local[axis]);
        point.upper[axis] = roundedUp(local[axis]);
      }
      items[i].box.extend(point);
    }
  }
  Builder builder(*this, std::move(items));
  builder.build();
  triangles_.reserve(triangles.size());
  for (const Item& item : builder.items()) triangles_.push_back(triangles[item.index]);
}

Nearest Hierarchy::search(const Vector3& x, Nearest best) const {
  const Eigen::Vector3f local = ((x - center_) * scale_).cast<float>();
  const Eigen::Array4f px = Eigen::Array4f::Constant(local[0]);
  const Eigen::Array4f py = Eigen::Array4f::Constant(local[1]);
  const Eigen::Array4f pz = Eigen::Array4f::Constant(local[2]);

  // A box counts as out of reach when its distance b exceeds that of the best triangle, d, by more than δ, which covers
  // the roundings of x to float, of the box's corners and of d itself (relative ones: the factor below). Without a
  // root: (d + δ)² ≤ (1 + s) d² + (1 + 1/s) δ², here with s = 1/1000 and some to spare.
  const float reach = std::max(local.cwiseAbs().maxCoeff(), 1.0f);
  const float delta = 4 * std::numeric_limits<float>::epsilon() * reach;
  const float slack = 1100 * delta * delta;
  const double relative = 1.002 * scale_ * scale_;
  const auto limitOf = [&](double squared) { return static_cast<float>(squared * relative) + slack; };
  float limit = limitOf(best.squaredDistance);

  struct Waiting {
    float squaredDistance;
    std::uint32_t child;
  };
  std::array<Waiting, kStackSize> stack;
  std::size_t top = 0;
  std::uint32_t current = 0;
  while (true) {
    if (current & kLeafBit) {
      const std::uint32_t first = current & kSlotMask;
      const std::uint32_t last = first + ((current >> 28) & 7);
      for (std::uint32_t slot = first; slot <= last; ++slot) {
        const TriangleFrame& frame = triangles_[slot];
        const double squared = squaredDistance(frame, x);
        if (!(squared <= best.squaredDistance)) continue;  // also leaves out the NaN of an infinite x
        if (squared == best.squaredDistance && frame.triangle >= best.triangle) continue;
        best = {slot, squared, frame.triangle};
        limit = limitOf(squared);
      }
    } else {
      const Node& node = nodes_[current];
      const Eigen::Array4f dx = (node.lower[0] - px).max(px - node.upper[0]).max(0.0f);
      const Eigen::Array4f dy = (node.lower[1] - py).max(py - node.upper[1]).max(0.0f);
      const Eigen::Array4f dz = (node.lower[2] - pz).max(pz - node.upper[2]).max(0.0f);
      const Eigen::Array4f squared = dx * dx + dy * dy + dz * dz;
      // farthest first onto the stack, so that the nearest comes off next
      const std::size_t bottom = top;
      for (int lane = 0; lane < 4; ++lane) {
        if (!(squared[lane] <= limit) || node.child[lane] == kEmpty) continue;
        std::size_t place = top++;
        for (; place > bottom && stack[place - 1].squaredDistance < squared[lane]; --place)
          stack[place] = stack[place - 1];
        stack[place] = {squared[lane], node.child[lane]};
      }
    }
    do {
      if (top == 0) return best;
      --top;
    } while (!(stack[top].squaredDistance <= limit));
    current = stack[top].child;
  }
}

}  // namespace hpsdf::distance
