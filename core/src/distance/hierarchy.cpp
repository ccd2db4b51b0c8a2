#include "distance/hierarchy.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "distance/search.h"

namespace hpsdf::distance {
namespace {

constexpr std::uint32_t kLeafSize = 4;
constexpr int kBins = 16;
constexpr float kNarrowest = 1e-30f;  ///< extents below would give bins no width

/// Below this level nodes are halved by count, so that no input makes the tree deeper than kMaxLevel + 32 levels
/// (2^32 triangles, each level at least halves a range).
constexpr int kMaxLevel = 32;
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
  std::uint32_t begin = 0, end = 0;
  FloatBox box = {};

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

/// Top-down: a node's range is split where the surface-area heuristic is least, then the child of largest area again,
/// until there are four.
class Builder {
 public:
  /// A tree, or what hangs below one child of a node. Its first node or block is its root.
  struct Tree {
    std::vector<Node> nodes;  ///< boxes still to be fitted
    std::vector<Block> blocks;
    std::vector<std::array<Range, kWidth>> ranges;  ///< the items below each child of each node
  };

  explicit Builder(std::vector<Item> items) : items_(std::move(items)) {}

  Tree build() {
    Tree tree;
    buildNode(tree, makeRange(0, static_cast<std::uint32_t>(items_.size())), 0);
    return tree;
  }

  /// In the order of the tree's blocks.
  const std::vector<Item>& items() const { return items_; }

 private:
  static constexpr std::uint32_t kWorthATask = 8192;  // items

  Range makeRange(std::uint32_t begin, std::uint32_t end) const {
    Range range{begin, end, {}};
    for (std::uint32_t i = begin; i < end; ++i) range.box.extend(items_[i].box);
    return range;
  }

  std::uint32_t buildNode(Tree& tree, const Range& whole, int level) {
    const auto self = static_cast<std::uint32_t>(tree.nodes.size());
    tree.nodes.emplace_back();
    std::array<Range, kWidth> parts;
    parts[0] = whole;
    const int count = divide(parts, level);
    tree.ranges.push_back(parts);
    std::array<std::uint32_t, kWidth> children;
    children.fill(kEmpty);
    if (whole.size() > kWorthATask) {
      // each into a tree of its own, put together in their order: the same tree as below, whoever is first
      std::array<Tree, kWidth> trees;
      tbb::parallel_for(0, count, [&](int lane) { buildChild(trees[lane], parts[lane], level + 1); });
      for (int lane = 0; lane < count; ++lane) children[lane] = append(tree, trees[lane]);
    } else {
      for (int lane = 0; lane < count; ++lane) children[lane] = buildChild(tree, parts[lane], level + 1);
    }
    std::copy(children.begin(), children.end(), tree.nodes[self].child);
    return self;
  }

  std::uint32_t buildChild(Tree& tree, const Range& range, int level) {
    if (range.size() > kLeafSize) return buildNode(tree, range, level);
    tree.blocks.push_back({{}, range.begin, range.size()});
    return kBlockBit | static_cast<std::uint32_t>(tree.blocks.size() - 1);
  }

  /// Returns what stands for the root of `part` among the children of a node.
  static std::uint32_t append(Tree& tree, const Tree& part) {
    const auto nodes = static_cast<std::uint32_t>(tree.nodes.size());
    const auto blocks = static_cast<std::uint32_t>(tree.blocks.size());
    for (Node node : part.nodes) {
      for (std::uint32_t& child : node.child)
        if (child != kEmpty) child += child & kBlockBit ? blocks : nodes;
      tree.nodes.push_back(node);
    }
    tree.blocks.insert(tree.blocks.end(), part.blocks.begin(), part.blocks.end());
    tree.ranges.insert(tree.ranges.end(), part.ranges.begin(), part.ranges.end());
    return part.nodes.empty() ? kBlockBit | blocks : nodes;
  }

  int divide(std::array<Range, kWidth>& parts, int level) {
    int count = 1;
    while (count < kWidth) {
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
    if (level >= kMaxLevel || !(extent[widest] > kNarrowest)) return splitByCount(range, widest);

    const Bins bins{centers.lower, (extent > kNarrowest).select(kBins / extent, 0)};
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

  std::vector<Item> items_;
};

/// A box whose axes are `axes`' columns, as float, around the corners that `visit` shows.
struct OrientedBox {
  Eigen::Vector3f center, half;
  Eigen::Matrix3f axes;

  float area() const { return half[0] * half[1] + half[1] * half[2] + half[2] * half[0]; }
};

template <typename Visit>
OrientedBox boxAround(const Eigen::Matrix3d& directions, const Visit& visit) {
  OrientedBox box;
  box.axes = directions.cast<float>();
  const Eigen::Matrix3d axes = box.axes.cast<double>();  // as rounded: what the extents are measured along
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  visit([&](const Vector3& corner) {
    const Vector3 along = axes.transpose() * corner;
    low = low.cwiseMin(along);
    high = high.cwiseMax(along);
  });
  box.center = (axes * ((low + high) / 2)).cast<float>();
  const Vector3 middle = axes.transpose() * box.center.cast<double>();
  const Vector3 half = (high - middle).cwiseMax(middle - low);
  for (int i = 0; i < 3; ++i) box.half[i] = roundedUp(half[i]);
  return box;
}

/// Fits the boxes of the nodes, and the blocks' numbers, to triangles that lie in their final order.
class Fitter {
 public:
  Fitter(const Hierarchy& hierarchy, const std::vector<TriangleFrame>& triangles)
      : hierarchy_(hierarchy), triangles_(triangles) {}

  void fit(Node& node, const std::array<Range, kWidth>& ranges) const {
    for (int lane = 0; lane < kWidth; ++lane) {
      const OrientedBox box = ranges[lane].size() > 0 ? tightBox(ranges[lane]) : OrientedBox{};
      for (int i = 0; i < 3; ++i) {
        node.field[Node::center + i][lane] = box.center[i];
        node.field[Node::half + i][lane] = box.half[i];
        for (int k = 0; k < 3; ++k) node.field[Node::axes + 3 * i + k][lane] = box.axes(k, i);
      }
    }
  }

  void fit(Block& block) const {
    for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
      const TriangleFrame& frame = triangles_[block.first + std::min(lane, block.count - 1)];
      const double scale = hierarchy_.scale();
      const Vector3 origin = hierarchy_.local(frame.origin);
      const auto set = [&](int field, double value) { block.field[field][lane] = static_cast<float>(value); };
      for (int i = 0; i < 3; ++i) {
        set(Block::origin + i, origin[i]);
        set(Block::along + i, frame.along[i]);
        set(Block::across + i, frame.across[i]);
      }
      set(Block::length, frame.length * scale);
      set(Block::apexAlong, frame.apexAlong * scale);
      set(Block::apexAcross, frame.apexAcross * scale);
      set(Block::inverseLeft, frame.inverseSquaredLeft / (scale * scale));
      set(Block::inverseRight, frame.inverseSquaredRight / (scale * scale));
    }
  }

 private:
  OrientedBox tightBox(const Range& range) const {
    const auto visitCorners = [&](const auto& visit) {
      for (std::uint32_t slot = range.begin; slot < range.end; ++slot)
        for (const Vector3& corner : cornersOf(triangles_[slot])) visit(hierarchy_.local(corner));
    };
    const OrientedBox upright = boxAround(Eigen::Matrix3d::Identity(), visitCorners);
    const OrientedBox leaning = boxAround(axesOf(range, upright.center.cast<double>(), visitCorners), visitCorners);
    return leaning.area() < upright.area() ? leaning : upright;
  }

  /// The mean normal, the widest direction across it, and the third.
  template <typename Visit>
  Eigen::Matrix3d axesOf(const Range& range, const Vector3& center, const Visit& visitCorners) const {
    Vector3 normal = Vector3::Zero();
    for (std::uint32_t slot = range.begin; slot < range.end; ++slot)
      normal += triangles_[slot].normal * (triangles_[slot].length * triangles_[slot].apexAcross);
    normal = normal.squaredNorm() > 0 ? Vector3(normal.normalized()) : Vector3(Vector3::UnitZ());
    const Vector3 u = normal.unitOrthogonal();
    const Vector3 v = normal.cross(u);
    double uu = 0, uv = 0, vv = 0;
    visitCorners([&](const Vector3& corner) {
      const double a = u.dot(corner - center), b = v.dot(corner - center);
      uu += a * a, uv += a * b, vv += b * b;
    });
    const double angle = std::atan2(2 * uv, uu - vv) / 2;
    const Vector3 widest = std::cos(angle) * u + std::sin(angle) * v;
    Eigen::Matrix3d axes;
    axes << normal, widest, normal.cross(widest);
    return axes;
  }

  const Hierarchy& hierarchy_;
  const std::vector<TriangleFrame>& triangles_;
};

}  // namespace

Hierarchy::Hierarchy(std::vector<TriangleFrame> triangles) {
  Box box;
  for (const TriangleFrame& frame : triangles)
    for (const Vector3& corner : cornersOf(frame)) box.extend(corner);
  center_ = box.center();
  const double half = box.sizes().maxCoeff() / 2;
  scale_ = half > 0 ? 1 / half : 1;

  std::vector<Item> items(triangles.size());
  tbb::parallel_for(std::size_t{0}, items.size(), [&](std::size_t i) {
    items[i].index = static_cast<std::uint32_t>(i);
    for (const Vector3& corner : cornersOf(triangles[i])) {
      const Vector3 local = (corner - center_) * scale_;
      FloatBox point{Eigen::Array4f::Zero(), Eigen::Array4f::Zero()};
      for (int axis = 0; axis < 3; ++axis) {
        point.lower[axis] = roundedDown(local[axis]);
        point.upper[axis] = roundedUp(local[axis]);
      }
      items[i].box.extend(point);
    }
  });
  Builder builder(std::move(items));
  Builder::Tree tree = builder.build();
  nodes_ = std::move(tree.nodes);
  blocks_ = std::move(tree.blocks);
  triangles_.resize(triangles.size());
  tbb::parallel_for(std::size_t{0}, triangles.size(),
                    [&](std::size_t slot) { triangles_[slot] = triangles[builder.items()[slot].index]; });
  const Fitter fitter(*this, triangles_);
  tbb::parallel_for(std::size_t{0}, nodes_.size(), [&](std::size_t n) { fitter.fit(nodes_[n], tree.ranges[n]); });
  tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t b) { fitter.fit(blocks_[b]); });
}

Nearest Hierarchy::nearest(const Vector3& x) const {
  Search<1> search(*this, {x});
  run(search);
  return search.result(0);
}

void Hierarchy::nearest(const std::array<Vector3, kPacket>& points, std::array<Nearest, kPacket>& nearest) const {
  Search<kPacket> search(*this, points);
  for (const Nearest& start : nearest) search.addSeed(start.place);
  run(search);
  for (int lane = 0; lane < kPacket; ++lane) nearest[lane] = search.result(lane);
}

}  // namespace hpsdf::distance
