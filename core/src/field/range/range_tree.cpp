#include "field/range/range_tree.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "field/query/evaluate.h"
#include "field/query/leaves.h"
#include "field/query/quantized.h"
#include "hpsdf/error.h"

namespace hpsdf::range {
namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr float kFloatEndless = std::numeric_limits<float>::infinity();

/// Rounding errors of an enclosure that is stored as floats and evaluated in float, relative to the sizes of its terms.
/// Some ten operations have errors of 2^-24 each.
constexpr double kFloatRounding = 0x1p-20;

float roundedDown(double number) {
  const auto nearest = static_cast<float>(number);
  return double(nearest) <= number ? nearest : std::nextafter(nearest, -kFloatEndless);
}
float roundedUpward(double number) { return -roundedDown(-number); }

/// Greatest size of an enclosure that is stored with its gradient.
constexpr double kLargest = 1e30;

/// Returns the greatest magnitude of the two linear functions of an enclosure, at most.
double sizeOf(const Enclosure& e, double reach) {
  return std::max(std::abs(e.lower), std::abs(e.upper)) + reach * e.gradient.lpNorm<1>();
}

constexpr std::uint32_t kNoGroup = Group::kTerminalBit - 1;

}  // namespace

/// Fills a tree from the leaves upward.
class TreeBuilder {
 public:
  explicit TreeBuilder(RangeTree& tree) : tree_(tree), field_(tree.field_) {}

  void build(const std::optional<Interval>& relevant) {
    const std::vector<query::OctreeNode> leaves = query::allLeaves(field_);
    const LeafEnclosures enclosureOfLeaf(field_, tree_.frame_, relevant);
    leaves_.resize(leaves.size());
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t n) { leaves_[n] = enclosureOfLeaf(leaves[n]); });
    order_.resize(field_.nodes.size());
    for (std::size_t n = 0; n < leaves.size(); ++n) order_[leaves[n].node] = static_cast<std::uint32_t>(n);
    if (tree_.reach_ > 1 && !field_.bounds.empty()) spreadErrors(leaves);

    const std::uint32_t cells = std::max({field_.grid[0], field_.grid[1], field_.grid[2], 2U});
    const int levels = std::bit_width(cells - 1);
    const double half = std::ldexp(0.5, levels);
    tree_.root_ = {{half, half, half}, half};
    addAbove({0, 0, 0}, levels);
    tree_.groups_.shrink_to_fit();
    tree_.details_.shrink_to_fit();
    tree_.errors_.shrink_to_fit();
  }

 private:
  /// An enclosure and the link by which a group refers to it.
  struct Linked {
    Enclosure enclosure;
    std::uint32_t link;
  };
  using Children = std::array<std::optional<Linked>, 8>;

  /// In a blended field, a value may lie between those of two leaves while the error bound of only one of them holds
  /// for it. Gives each leaf the greatest error bound of the leaves that touch it.
  void spreadErrors(const std::vector<query::OctreeNode>& leaves) {
    std::vector<double> spread(leaves.size());
    const auto widen = [&](std::uint32_t node, std::uint32_t by) {
      double& error = spread[order_[node]];
      error = std::max({error, double(field_.bounds[node].error), double(field_.bounds[by].error)});
    };
    for (const query::OctreeNode& leaf : leaves) {
      widen(leaf.node, leaf.node);
      query::forEachNeighbour(field_, leaf, [&](const query::OctreeNode& neighbour) {
        widen(leaf.node, neighbour.node);
        widen(neighbour.node, leaf.node);
      });
    }
    for (std::size_t n = 0; n < leaves.size(); ++n) {
      leaves_[n].whole.error = spread[n];
      for (PartGroup& group : leaves_[n].groups)
        for (auto& part : group.parts) part->error = spread[n];
    }
  }

  /// Adds the groups of a cell that holds 2^level base cells along each axis, from the base cell `from` on.
  Linked addAbove(const std::array<std::uint32_t, 3>& from, int level) {
    const std::uint32_t group = addGroup(0);
    Children children;
    for (std::uint32_t number = 0; number < 8; ++number) {
      std::array<std::uint32_t, 3> at = from;
      for (int axis = 0; axis < 3; ++axis) at[axis] += (number >> axis & 1) << (level - 1);
      if (at[0] >= field_.grid[0] || at[1] >= field_.grid[1] || at[2] >= field_.grid[2]) continue;
      children[number] =
          level > 1 ? addAbove(at, level - 1) : addNode((at[2] * field_.grid[1] + at[1]) * field_.grid[0] + at[0]);
    }
    return setGroup(group, children, {0.5, 0.5, tree_.reach_});
  }

  Linked addNode(std::uint32_t node) {
    const std::uint64_t bits = field_.nodes[node];
    if (node::isLeaf(bits)) return addLeaf(node, leaves_[order_[node]]);
    const std::uint32_t group = addGroup(0);
    Children children;
    for (std::uint32_t number = 0; number < 8; ++number) children[number] = addNode(node::firstChild(bits) + number);
    return setGroup(group, children, {0.5, 0.5, tree_.reach_});
  }

  Linked addLeaf(std::uint32_t node, const LeafEnclosure& leaf) {
    if (leaf.groups.empty()) return {leaf.whole, node | Group::kTerminalBit};
    return {leaf.whole, addParts(node, leaf, 0, 1).link};
  }

  Linked addParts(std::uint32_t node, const LeafEnclosure& leaf, std::int32_t index, int level) {
    const std::uint32_t group = addGroup(level);
    const PartGroup& parts = leaf.groups[index];
    Children children;
    for (int number = 0; number < 8; ++number)
      children[number] = {*parts.parts[number], parts.groups[number] == PartGroup::kWhole
                                                    ? node | Group::kTerminalBit
                                                    : addParts(node, leaf, parts.groups[number], level + 1).link};
    return setGroup(group, children, {0.5, 0.5, 1});
  }

  std::uint32_t addGroup(int levelsBelowLeaf) {
    const std::size_t index = tree_.groups_.size();
    if (index >= kNoGroup) throw Error("the field has too many cells for ranges over boxes");
    tree_.groups_.emplace_back();
    tree_.details_.emplace_back();
    tree_.details_.back().levelsBelowLeaf = static_cast<std::uint8_t>(levelsBelowLeaf);
    if (!field_.bounds.empty()) tree_.errors_.emplace_back();
    return static_cast<std::uint32_t>(index);
  }

  Linked setGroup(std::uint32_t index, const Children& children, const PartLayout& layout) {
    Parts parts;
    for (std::size_t number = 0; number < 8; ++number) {
      if (children[number]) parts[number] = children[number]->enclosure;
      set(index, number, children[number], layout.reach);
    }
    return {unionOf(parts, layout), index};
  }

  void set(std::uint32_t index, std::size_t number, const std::optional<Linked>& child, double reach) {
    Group& group = tree_.groups_[index];
    Details& details = tree_.details_[index];
    Enclosure e = child ? child->enclosure : Enclosure{};
    double size = sizeOf(e, reach);
    if (size > kLargest) {  // Sums of such numbers might be no numbers.
      e.gradient.setZero();
      e.lower = e.min;
      e.upper = e.max;
      size = sizeOf(e, reach);
    }
    const double slack = kFloatRounding * size + e.noise;
    group.lower[number] = roundedDown(e.lower - slack);
    group.upper[number] = roundedUpward(e.upper + slack);
    group.x[number] = static_cast<float>(e.gradient.x());
    group.y[number] = static_cast<float>(e.gradient.y());
    group.z[number] = static_cast<float>(e.gradient.z());
    group.min[number] = child ? roundedDown(e.min - e.noise) : kFloatEndless;
    group.max[number] = child ? roundedUpward(e.max + e.noise) : -kFloatEndless;
    group.link[number] = child ? child->link : kNoGroup;
    details.bend[number] = roundedUpward(e.bend);
    details.noise[number] = roundedUpward(e.noise);
    details.uncertainSigns |= static_cast<std::uint8_t>(unsigned(e.isSignUncertain) << number);
    if (!tree_.errors_.empty()) tree_.errors_[index][number] = roundedUpward(e.error);
  }

  RangeTree& tree_;
  const FieldData& field_;
  std::vector<LeafEnclosure> leaves_;  ///< in depth-first order
  std::vector<std::uint32_t> order_;   ///< by node of the field: the leaf's index in `leaves_`
};

/// Finds the range over one box, by branch and bound: a cell that lies in the box contributes its range as a whole. A
/// cell that the box cuts is divided only if its bounds reach beyond what values in the box are known to reach, by more
/// than a small part of the box's range.
class RangeSearch {
 public:
  /// Cells with values in `known` alone do not matter. Without it, values that the field certainly comes close to
  /// serve instead.
  RangeSearch(const RangeTree& tree, const Box& box, const std::optional<Interval>& known)
      : tree_(tree), frame_(tree.frame_) {
    if (known) {
      knownMin_ = roundedUpward(known->min);
      knownMax_ = roundedDown(known->max);
      isKnown_ = true;
    }
    // Rounding of local coordinates has errors of some 2^-53 of the root's edge.
    const double slack = 0x1p-46 * tree.root_.half;
    for (int axis = 0; axis < 3; ++axis) {
      lower_[axis] = query::gridCoordinate(frame_, axis, box.min()[axis]) - slack;
      upper_[axis] = query::gridCoordinate(frame_, axis, box.max()[axis]) + slack;
      // Beyond the domain's walls there is nothing, so that a box that touches a wall covers the cells there.
      if (lower_[axis] <= 0) lower_[axis] = -kEndless;
      if (upper_[axis] >= frame_.cells[axis]) upper_[axis] = kEndless;
    }
  }

  Extent run() {
    const Cube& root = tree_.root_;
    divide({.link = 0, .group = 0, .number = 0, .min = 0, .max = 0, .cube = root, .leafCentre = root.centre});
    while (size_ > 0) {
      const Cell cell = stack_[--size_];
      if (!sticksOut(cell.min, cell.max))
        add(cell.min, cell.max, cell);
      else if ((cell.link & Group::kTerminalBit) != 0)
        addLeaf(cell);
      else
        divide(cell);
    }
    return {{min_, max_}, distance_};
  }

 private:
  /// A cell of the tree that the box cuts.
  struct Cell {
    std::uint32_t link;
    std::uint32_t group;   ///< the group that holds the cell
    std::uint32_t number;  ///< its place in the group
    float min, max;        ///< bounds of the field in the cell and the box
    Cube cube;
    std::array<double, 3> leafCentre;  ///< for a part of a leaf: the centre of the leaf
  };

  /// The parts of the box in the two halves of a cell along one axis, in local coordinates of the halves.
  struct Halves {
    std::array<float, 2> from, to;
    std::array<double, 2> centre;
    unsigned meets = 0, covers = 0;  ///< bit masks of the halves that the box meets, and of those within the box
  };

  /// Largest number of cells that wait: all levels of a tree below 2^32 base cells along an axis, seven or eight each.
  static constexpr std::size_t kMostWaiting = 8 * (32 + kMaxDepth + 4);
  /// The width that the range may have beyond what is certainly needed, at either end, over the width of the range.
  static constexpr float kSlack = 1.0F / 8;

  Halves halvesAlong(int axis, double centre, double half, double reach) const {
    Halves halves;
    const double unit = 1 / half;
    for (int side = 0; side < 2; ++side) {
      halves.centre[side] = centre + (side == 0 ? -half : half);
      const double from = (lower_[axis] - halves.centre[side]) * unit, to = (upper_[axis] - halves.centre[side]) * unit;
      halves.meets |= unsigned(from <= reach && to >= -reach) << side;
      halves.covers |= unsigned(from <= -reach && to >= reach) << side;
      halves.from[side] = static_cast<float>(std::max(from, -reach));
      halves.to[side] = static_cast<float>(std::min(to, reach));
    }
    return halves;
  }

  void divide(const Cell& cell) {
    const Group& group = tree_.groups_[cell.link];
    const int level = tree_.details_[cell.link].levelsBelowLeaf;
    const double reach = level == 0 ? tree_.reach_ : 1;
    const double half = cell.cube.half * (level == 1 ? tree_.reach_ : 1) / 2;
    std::array<Halves, 3> halves;
    for (int axis = 0; axis < 3; ++axis) halves[axis] = halvesAlong(axis, cell.cube.centre[axis], half, reach);
    const unsigned meets = cellsOf(halves[0].meets, halves[1].meets, halves[2].meets);
    const unsigned covers = cellsOf(halves[0].covers, halves[1].covers, halves[2].covers);

    std::array<float, 8> low, high;
    findBounds(group, halves, low, high);
    addWhole(group, cell.link, meets & covers);
    unsigned cut = meets & ~covers;
    for (unsigned rest = cut; rest != 0; rest &= rest - 1) {
      const int number = std::countr_zero(rest);
      if (group.link[number] == kNoGroup) {
        cut &= ~(1U << number);
        continue;
      }
      if (isKnown_) continue;
      knownMin_ = std::min(knownMin_, std::max(group.upper[number] + low[number], group.min[number]));
      knownMax_ = std::max(knownMax_, std::min(group.lower[number] + high[number], group.max[number]));
    }
    for (unsigned rest = cut; rest != 0; rest &= rest - 1) {
      const int number = std::countr_zero(rest);
      const float min = std::max(group.lower[number] + low[number], group.min[number]);
      const float max = std::min(group.upper[number] + high[number], group.max[number]);
      Cell child{group.link[number], cell.link, unsigned(number), min, max, {{}, half}, cell.leafCentre};
      for (int axis = 0; axis < 3; ++axis) child.cube.centre[axis] = halves[axis].centre[number >> axis & 1];
      if (level == 0) child.leafCentre = child.cube.centre;
      if (sticksOut(min, max))
        stack_[size_++] = child;
      else
        add(min, max, child);
    }
  }

  /// Returns the bit mask of the cells whose halves along all axes are in the given masks.
  static unsigned cellsOf(unsigned x, unsigned y, unsigned z) {
    constexpr std::array<unsigned, 4> kX = {0, 0x55, 0xaa, 0xff}, kY = {0, 0x33, 0xcc, 0xff},
                                      kZ = {0, 0x0f, 0xf0, 0xff};
    return kX[x] & kY[y] & kZ[z];
  }

  /// Computes the least and the greatest value of each linear function over the part of the box in its cell, without
  /// its constant term. Cells that the box does not meet have numbers without a meaning.
  static void findBounds(const Group& group, const std::array<Halves, 3>& halves, std::array<float, 8>& low,
                         std::array<float, 8>& high) {
    std::array<std::array<float, 8>, 3> from, to;
    for (int number = 0; number < 8; ++number)
      for (int axis = 0; axis < 3; ++axis) {
        from[axis][number] = halves[axis].from[number >> axis & 1];
        to[axis][number] = halves[axis].to[number >> axis & 1];
      }
    for (int number = 0; number < 8; ++number) {
      const float x0 = group.x[number] * from[0][number], x1 = group.x[number] * to[0][number];
      const float y0 = group.y[number] * from[1][number], y1 = group.y[number] * to[1][number];
      const float z0 = group.z[number] * from[2][number], z1 = group.z[number] * to[2][number];
      low[number] = (x0 < x1 ? x0 : x1) + (y0 < y1 ? y0 : y1) + (z0 < z1 ? z0 : z1);
      high[number] = (x0 < x1 ? x1 : x0) + (y0 < y1 ? y1 : y0) + (z0 < z1 ? z1 : z0);
    }
  }

  /// Adds the ranges of those cells of a group that lie in the box.
  void addWhole(const Group& group, std::uint32_t index, unsigned covered) {
    for (; covered != 0; covered &= covered - 1) {
      const int number = std::countr_zero(covered);
      if (group.link[number] != kNoGroup) add(group.min[number], group.max[number], index, number);
    }
  }

  bool sticksOut(float min, float max) const {
    const double least = std::min(min_, double(knownMin_)), greatest = std::max(max_, double(knownMax_));
    const double slack = isKnown_ ? 0 : kSlack * std::max(greatest - least, 0.0);
    return min < least - slack || max > greatest + slack;
  }

  void add(double min, double max, const Cell& cell) { add(min, max, cell.group, cell.number); }

  void add(double min, double max, std::uint32_t group, std::size_t number) {
    min_ = std::min(min_, min);
    max_ = std::max(max_, max);
    if (tree_.errors_.empty()) return;
    const double error = tree_.errors_[group][number];
    distance_.min = std::min(distance_.min, min - error);
    distance_.max = std::max(distance_.max, max + error);
  }

  /// Adds a leaf that the box cuts, after its bounds have been tightened by the value of the leaf in the middle of the
  /// box's part.
  void addLeaf(const Cell& cell) {
    const Details& details = tree_.details_[cell.group];
    const double reach = details.levelsBelowLeaf == 0 ? tree_.reach_ : 1;
    std::array<double, 3> middle;
    Vector3 extent;
    double greatest = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double centre = cell.cube.centre[axis], half = cell.cube.half;
      const double from = std::max({lower_[axis], centre - reach * half, 0.0});
      const double to = std::min({upper_[axis], centre + reach * half, frame_.cells[axis]});
      middle[axis] = (from + to) / 2;
      const double halfExtent = std::max((to - from) / 2, 0.0);
      greatest = std::max(greatest, halfExtent / half);
      extent[axis] = halfExtent / frame_.cells[axis] * frame_.size[axis];
    }
    const std::uint64_t bits = tree_.field_.nodes[cell.link & ~Group::kTerminalBit];
    Enclosure found;
    if (node::isExact(bits))
      found = exactAround(cell, bits, middle, extent.norm());
    else
      found = polynomialAround(cell, bits, middle, extent);
    const double spread = details.bend[cell.number] * greatest * greatest / 2 + details.noise[cell.number];
    // Where numbers are so large that the spread is not finite, the bounds of the cell remain.
    const double low = found.min - spread, high = found.max + spread;
    add(low > cell.min ? low : cell.min, high < cell.max ? high : cell.max, cell);
  }

  Enclosure exactAround(const Cell& cell, std::uint64_t bits, const std::array<double, 3>& middle,
                        double radius) const {
    // A part lies in one octant of the leaf. The list of each octant is complete only there, so that in a whole leaf
    // the octant of the middle counts.
    const bool isWhole = tree_.details_[cell.group].levelsBelowLeaf == 0;
    const std::array<double, 3>& inOctant = isWhole ? middle : cell.cube.centre;
    int octant = 0;
    for (int axis = 0; axis < 3; ++axis) octant |= int(inOctant[axis] >= cell.leafCentre[axis]) << axis;
    const Vector3 x = query::worldPoint(frame_, middle);
    KnownDistance known{.offset = tree_.field_.exact.offset,
                        .isSignUncertain = (tree_.details_[cell.group].uncertainSigns >> cell.number & 1) != 0};
    query::evaluateExact(tree_.field_.exact, bits, octant, {&x, 1}, &known.value);
    Enclosure found;
    setAround(found, known, radius);
    return found;
  }

  /// Returns the range of the linear function that touches a leaf's polynomial in the middle.
  Enclosure polynomialAround(const Cell& cell, std::uint64_t bits, const std::array<double, 3>& middle,
                             const Vector3& extent) const {
    const int levels = tree_.details_[cell.group].levelsBelowLeaf;
    const double half = levels == 0 ? cell.cube.half : std::ldexp(cell.cube.half, levels) / tree_.reach_;
    query::LeafPoint point{bits, std::ilogb(0.5 / half + 0.25), {}, {}, 0};
    for (int axis = 0; axis < 3; ++axis) point.local[axis] = (middle[axis] - cell.leafCentre[axis]) / half;
    ValueAndGradient at;
    std::visit([&](const auto& c) { query::evaluateLeaf(c, frame_, point, at); }, tree_.field_.coefficients);
    const double climb = at.gradient.cwiseAbs().dot(extent);
    Enclosure found;
    found.min = at.value - climb;
    found.max = at.value + climb;
    return found;
  }

  const RangeTree& tree_;
  const GridFrame& frame_;
  std::array<double, 3> lower_, upper_;  ///< the box in grid coordinates
  double min_ = kEndless, max_ = -kEndless;
  Interval distance_{kEndless, -kEndless};
  /// Values that the field has in the box or comes close to: an upper bound of the minimum, a lower bound of the
  /// maximum. They decide what is divided, but are no part of the result.
  float knownMin_ = kFloatEndless, knownMax_ = -kFloatEndless;
  bool isKnown_ = false;  ///< the caller gave these values
  std::size_t size_ = 0;
  std::array<Cell, kMostWaiting> stack_;
};

RangeTree::RangeTree(const Field& field, const std::optional<Interval>& relevant)
    : field_(field.data()), frame_(field.lookupGrid().frame), reach_(reachOf(field.data())), root_{} {
  if (field_.nodes.size() >= Group::kTerminalBit)
    throw Error(ErrorKind::limit, "", "the field has too many cells for ranges over boxes: 2^31 or more");
  TreeBuilder(*this).build(relevant);
}

Extent RangeTree::range(const Box& box, const std::optional<Interval>& known) const {
  return RangeSearch(*this, box, known).run();
}

std::size_t RangeTree::bytes() const {
  const auto sizeOf = [](const auto& values) { return values.capacity() * sizeof(values[0]); };
  return sizeOf(groups_) + sizeOf(details_) + sizeOf(errors_);
}

}  // namespace hpsdf::range
