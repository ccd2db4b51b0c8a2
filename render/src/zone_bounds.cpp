#include "zone_bounds.h"

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
    findRows(scale, shift);
    for (int a = 0; a < size_; ++a)
      for (int b = 0; a + b < size_; ++b) {
        const int most = size_ - 1 - a - b;
        const auto along = [&](int i) -> double& {
          return axis == 0 ? at(i, a, b) : axis == 1 ? at(a, i, b) : at(a, b, i);
        };
        // row i changes nothing above i: in place, from below
        for (int j = 0; j <= most; ++j) {
          double sum = 0;
          for (int i = j; i <= most; ++i) sum += rows_[i][j] * along(i);
          along(j) = sum;
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

  /// Bounds of the lengths of the gradient and of the matrix of second derivatives, of coordinates of which the present
  /// ones are `perUnit` each.
  std::array<double, 2> steepness(const Vector3& perUnit) {
    Vector3 gradient = Vector3::Zero(), pure = Vector3::Zero(), mixed = Vector3::Zero();
    for (int i = 0; i < size_; ++i)
      for (int j = 0; i + j < size_; ++j)
        for (int k = 0; i + j + k < size_; ++k) {
          const double c = std::abs(at(i, j, k));
          const Vector3 first = perUnit.cwiseProduct(0.5 * Vector3(i * (i + 1), j * (j + 1), k * (k + 1)));
          const auto second = [](double n) { return 0.125 * (n - 1) * n * (n + 1) * (n + 2); };
          gradient += c * first;
          pure += c * perUnit.cwiseAbs2().cwiseProduct(Vector3(second(i), second(j), second(k)));
          mixed += c * Vector3(first.y() * first.z(), first.z() * first.x(), first.x() * first.y());
        }
    return {gradient.norm(), std::sqrt(pure.squaredNorm() + 2 * mixed.squaredNorm())};
  }

 private:
  /// L_i(scale · s + shift) = Σ rows_[i][j] L_j(s), by L_i's recurrence and s L_j = ((j+1) L_{j+1} + j L_{j−1})/(2j+1).
  void findRows(double scale, double shift) {
    for (auto& row : rows_) std::fill_n(row.begin(), size_ + 1, 0.0);
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
  explicit Finder(const Field& field) : field_(field.data()), reaches_(field.directory().reaches) {}

  ZoneBounds bounds(const Placed& leaf) {
    double apart = 0, gradient = 0, second = 0;
    int deepest = deepestReach(leaf);
    bool anySmaller = false;
    visitTouching(field_, leaf, [&](const Placed& other) {
      deepest = std::max(deepest, deepestReach(other));
      anySmaller |= other.depth > leaf.depth;
      const double rounding = restrictBoth(leaf, other);
      ofOther_.subtract(ofLeaf_);
      const auto [slope, curve] = ofOther_.steepness(perUnit_);
      apart = std::max(apart, ofOther_.magnitude() * (1 + kWiden) + kWiden * rounding);
      gradient = std::max(gradient, slope * (1 + kWiden) + kWiden * rounding);
      second = std::max(second, curve * (1 + kWiden) + kWiden * rounding);
    });
    return combined(apart, gradient, second, std::ldexp(0.5 / field_.blend, deepest - leaf.depth), anySmaller);
  }

 private:
  int deepestReach(const Placed& leaf) const {
    int deepest = leaf.depth;
    for (int axis = 0; axis < 3; ++axis)
      for (const bool upper : {false, true})
        if (const int depth = reach::depth(reaches_[leaf.node], axis, upper); depth != reach::kWall)
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

  /// `inverse` is 1 over the least reach, in local coordinates. Near K axes Σ wₙ is at least 2^−K, the leaf's own
  /// weight, and no more than 2^K leaves reach the point, each with a weight that changes along those axes alone; where
  /// smaller leaves touch this one, any number of the eight that there may be, and along any axis.
  static ZoneBounds combined(double apart, double gradient, double second, double inverse, bool anySmaller) {
    const double slope = 0.75 * inverse, curve = 1.5 * inverse * inverse;  // of a ramp
    ZoneBounds bounds{static_cast<float>(apart), {}, {}};
    for (int near = 1; near <= 3; ++near) {
      const double axes = anySmaller ? 3 : near, leaves = anySmaller ? 8 : 1 << near, least = 1.0 / (1 << near);
      const double weightSlope = std::sqrt(axes) * slope;
      const double weightCurve = std::sqrt(axes * curve * curve + axes * (axes - 1) * std::pow(slope, 4));
      const bool two = leaves == 2;  // then it is one ramp over the sum of two: |λ'| ≤ slope/Σw
      const double bend = (two ? 1 : 2 * leaves) * weightSlope / least * apart + gradient;
      const double turn =
          (2 * leaves * (weightCurve * apart + weightSlope * gradient) + 2 * bend * leaves * weightSlope) / least +
          second;
      bounds.bend[near - 1] = static_cast<float>(bend * (1 + kWiden));
      bounds.curve[near - 1] = static_cast<float>(turn * (1 + kWiden));
    }
    return bounds;
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
