#include "view/blend_zone_bounds.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace hpsdf::render {
namespace {

constexpr double kWiden = 4e-6;  // as in node_bounds.cpp

/// A node and its box, in cells of depth kMaxDepth counted from the domain's lower corner.
struct Placed {
  std::uint32_t node;
  int depth;
  std::array<std::int64_t, 3> lo;

  std::int64_t width() const { return std::int64_t{1} << (kMaxDepth - depth); }
};

/// Calls visit(leaf) for each leaf below a node.
template <typename Enter, typename Visit>
void visitLeaves(const FieldData& field, const Placed& at, const Enter& enter, const Visit& visit) {
  if (!enter(at)) return;
  const std::uint64_t bits = field.nodes[at.node];
  if (node::isLeaf(bits)) return visit(at);
  for (std::uint32_t child = 0; child < 8; ++child) {
    Placed below{node::firstChild(bits) + child, at.depth + 1, at.lo};
    for (int axis = 0; axis < 3; ++axis)
      if ((child >> axis & 1) != 0) below.lo[axis] += below.width();
    visitLeaves(field, below, enter, visit);
  }
}

Placed baseCell(const FieldData& field, std::int64_t x, std::int64_t y, std::int64_t z) {
  return {static_cast<std::uint32_t>((z * field.grid[1] + y) * field.grid[0] + x),
          0,
          {x << kMaxDepth, y << kMaxDepth, z << kMaxDepth}};
}

/// Calls visit(other) for each leaf that touches this one, itself left out.
template <typename Visit>
void visitTouching(const FieldData& field, const Placed& leaf, const Visit& visit) {
  const auto touches = [&](const Placed& other) {
    for (int axis = 0; axis < 3; ++axis)
      if (other.lo[axis] > leaf.lo[axis] + leaf.width() || other.lo[axis] + other.width() < leaf.lo[axis]) return false;
    return true;
  };
  std::array<std::int64_t, 3> first, last;
  for (int axis = 0; axis < 3; ++axis) {
    first[axis] = std::max<std::int64_t>(0, (leaf.lo[axis] - 1) >> kMaxDepth);
    last[axis] = std::min<std::int64_t>(field.grid[axis] - 1, (leaf.lo[axis] + leaf.width()) >> kMaxDepth);
  }
  for (std::int64_t z = first[2]; z <= last[2]; ++z)
    for (std::int64_t y = first[1]; y <= last[1]; ++y)
      for (std::int64_t x = first[0]; x <= last[0]; ++x)
        visitLeaves(field, baseCell(field, x, y, z), touches, [&](const Placed& other) {
          if (other.node != leaf.node) visit(other);
        });
}

/// A polynomial's coefficients, those of i, j, k at (i · n + j) · n + k with n = degree + 1.
class Cube {
 public:
  template <typename T>
  void assign(const T* c, int degree, int size) {
    size_ = size;
    c_.assign(std::size_t(size) * size * size, 0.0);
    for (int i = 0; i <= degree; ++i)
      for (int j = 0; j <= degree - i; ++j)
        for (int k = 0; k <= degree - i - j; ++k) at(i, j, k) = *c++;
  }

  double& at(int i, int j, int k) { return c_[(std::size_t(i) * size_ + j) * size_ + k]; }

  /// To the coordinate s along an axis of which the one up to now is scale · s + shift.
  void restrict(int axis, double scale, double shift) {
    if (scale == 1 && shift == 0) return;
    findRows(scale, shift);
    const int n = size_, along = axis == 0 ? n * n : axis == 1 ? n : 1;
    const int first = axis == 0 ? n : n * n, second = axis == 2 ? n : 1;  // steps along the other two
    for (int a = 0; a < n; ++a)
      for (int b = 0; a + b < n; ++b) {
        double* line = c_.data() + a * first + b * second;
        // entry i changes nothing above i: in place, from below
        for (int j = 0; j < n - a - b; ++j) {
          double sum = 0;
          for (int i = j; i < n - a - b; ++i) sum += rows_[i][j] * line[i * along];
          line[j * along] = sum;
        }
      }
  }

  void subtract(const Cube& other) {
    for (std::size_t n = 0; n < c_.size(); ++n) c_[n] -= other.c_[n];
  }

  double magnitude() const {
    double sum = 0;
    for (const double c : c_) sum += std::abs(c);
    return sum;
  }

  /// A bound of the gradient's length, of coordinates of which the present ones are `perUnit` each.
  double steepness(const Vector3& perUnit) {
    Vector3 gradient = Vector3::Zero();
    for (int i = 0; i < size_; ++i)
      for (int j = 0; i + j < size_; ++j)
        for (int k = 0; i + j + k < size_; ++k)
          gradient += std::abs(at(i, j, k)) * Vector3(i * (i + 1), j * (j + 1), k * (k + 1));
    return 0.5 * perUnit.cwiseProduct(gradient).norm();
  }

 private:
  /// L_i(scale · s + shift) = Σ rows_[i][j] L_j(s), by L_i's recurrence and s L_j = ((j+1) L_{j+1} + j L_{j−1})/(2j+1).
  void findRows(double scale, double shift) {
    for (int i = 0; i < size_; ++i) std::fill_n(rows_[i].begin(), size_ + 1, 0.0);
    rows_[0][0] = 1;
    for (int i = 0; i + 1 < size_; ++i)
      for (int j = 0; j <= i + 1; ++j) {
        const double before = j > 0 ? rows_[i][j - 1] * j / (2 * j - 1) : 0;
        const double times = scale * (before + rows_[i][j + 1] * (j + 1) / (2 * j + 3)) + shift * rows_[i][j];
        rows_[i + 1][j] = ((2 * i + 1) * times - (i > 0 ? i * rows_[i - 1][j] : 0)) / (i + 1);
      }
  }

  int size_ = 0;
  std::vector<double> c_;
  std::array<std::array<double, kMaxDegree + 3>, kMaxDegree + 1> rows_;
};

/// One thread's finder.
class Finder {
 public:
  explicit Finder(const Field& field) : field_(field.data()), reaches_(field.lookupGrid().blendExtents) {}

  ZoneBounds bounds(const Placed& leaf) {
    double apart = 0, twist = 0;
    int deepest = deepestReach(leaf);
    visitTouching(field_, leaf, [&](const Placed& other) {
      deepest = std::max(deepest, deepestReach(other));
      const double rounding = restrictBoth(leaf, other);
      ofOther_.subtract(ofLeaf_);
      apart = std::max(apart, ofOther_.magnitude() * (1 + kWiden) + kWiden * rounding);
      twist = std::max(twist, ofOther_.steepness(perUnit_) * (1 + kWiden) + kWiden * rounding);
    });
    return {static_cast<float>(apart), static_cast<float>(twist),
            static_cast<float>(std::ldexp(2 * field_.blend, leaf.depth - deepest))};
  }

 private:
  int deepestReach(const Placed& leaf) const {
    int deepest = leaf.depth;
    for (int axis = 0; axis < 3; ++axis)
      for (const bool upper : {false, true})
        if (const int depth = blend_extent::depth(reaches_[leaf.node], axis, upper); depth != blend_extent::kWall)
          deepest = std::max(deepest, depth);
    return deepest;
  }

  /// Both polynomials on the part of the leaf that the other may reach; the sum of their coefficients' magnitudes.
  double restrictBoth(const Placed& leaf, const Placed& other) {
    const int size = std::max(degree(leaf), degree(other)) + 1;
    assign(ofLeaf_, leaf, size);
    assign(ofOther_, other, size);
    const double reach = field_.blend * double(std::min(leaf.width(), other.width()));
    for (int axis = 0; axis < 3; ++axis) {
      const double lo = std::max(double(leaf.lo[axis]), double(other.lo[axis]) - reach);
      const double hi = std::min(double(leaf.lo[axis] + leaf.width()), double(other.lo[axis] + other.width()) + reach);
      const auto take = [&](Cube& cube, const Placed& from) {
        const double half = 0.5 * double(from.width()), middle = double(from.lo[axis]) + half;
        cube.restrict(axis, 0.5 * (hi - lo) / half, (0.5 * (lo + hi) - middle) / half);
      };
      take(ofLeaf_, leaf);
      take(ofOther_, other);
      perUnit_[axis] = double(leaf.width()) / (hi - lo);
    }
    return ofLeaf_.magnitude() + ofOther_.magnitude();
  }

  int degree(const Placed& leaf) const { return node::degree(field_.nodes[leaf.node]); }

  void assign(Cube& cube, const Placed& leaf, int size) const {
    std::visit(
        [&](const auto& c) { cube.assign(c.data() + node::offset(field_.nodes[leaf.node]), degree(leaf), size); },
        field_.coefficients);
  }

  const FieldData& field_;
  const std::vector<std::uint32_t>& reaches_;
  Cube ofLeaf_, ofOther_;
  Vector3 perUnit_;
};

}  // namespace

std::vector<ZoneBounds> zoneBounds(const Field& field) {
  const FieldData& data = field.data();
  if (!(data.blend > 0)) return {};
  std::vector<Placed> leaves;
  for (std::int64_t z = 0; z < data.grid[2]; ++z)
    for (std::int64_t y = 0; y < data.grid[1]; ++y)
      for (std::int64_t x = 0; x < data.grid[0]; ++x)
        visitLeaves(
            data, baseCell(data, x, y, z), [](const Placed&) { return true; },
            [&](const Placed& leaf) { leaves.push_back(leaf); });
  std::vector<ZoneBounds> bounds(data.nodes.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 64), [&](const auto& range) {
    Finder finder(field);
    for (std::size_t n = range.begin(); n < range.end(); ++n) bounds[leaves[n].node] = finder.bounds(leaves[n]);
  });
  return bounds;
}

}  // namespace hpsdf::render
