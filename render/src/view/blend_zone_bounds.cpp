#include "hpsdf/render/blend_zone_bounds.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "view/exact_leaf.h"
#include "view/grid_space.h"

namespace hpsdf::render {
namespace {

/// A node and its box. Coordinates are from the domain's lower corner, in edges of the smallest possible cell.
struct NodeBox {
  std::uint32_t node;
  int depth;
  std::array<std::int64_t, 3> lo;

  std::int64_t width() const { return std::int64_t{1} << (kMaxDepth - depth); }
};

/// Calls visit(leaf) for each leaf below a node. The descent enters only nodes for which enter(node) is true.
template <typename Enter, typename Visit>
void visitLeaves(const FieldData& field, const NodeBox& at, const Enter& enter, const Visit& visit) {
  if (!enter(at)) return;
  const std::uint64_t bits = field.nodes[at.node];
  if (node::isLeaf(bits)) return visit(at);
  for (std::uint32_t child = 0; child < 8; ++child) {
    NodeBox below{node::firstChild(bits) + child, at.depth + 1, at.lo};
    for (int axis = 0; axis < 3; ++axis)
      if ((child >> axis & 1) != 0) below.lo[axis] += below.width();
    visitLeaves(field, below, enter, visit);
  }
}

/// Calls visit(cell) for each base cell with indices from `first` to `last`.
template <typename Visit>
void visitBaseCells(const FieldData& field, const std::array<std::int64_t, 3>& first,
                    const std::array<std::int64_t, 3>& last, const Visit& visit) {
  for (std::int64_t z = first[2]; z <= last[2]; ++z)
    for (std::int64_t y = first[1]; y <= last[1]; ++y)
      for (std::int64_t x = first[0]; x <= last[0]; ++x)
        visit(NodeBox{static_cast<std::uint32_t>((z * field.grid[1] + y) * field.grid[0] + x),
                      0,
                      {x << kMaxDepth, y << kMaxDepth, z << kMaxDepth}});
}

/// Calls visit(other) for each other leaf that touches `leaf`.
template <typename Visit>
void visitTouching(const FieldData& field, const NodeBox& leaf, const Visit& visit) {
  const auto touches = [&](const NodeBox& other) {
    for (int axis = 0; axis < 3; ++axis)
      if (other.lo[axis] > leaf.lo[axis] + leaf.width() || other.lo[axis] + other.width() < leaf.lo[axis]) return false;
    return true;
  };
  std::array<std::int64_t, 3> first, last;
  for (int axis = 0; axis < 3; ++axis) {
    first[axis] = std::max<std::int64_t>(0, (leaf.lo[axis] - 1) >> kMaxDepth);
    last[axis] = std::min<std::int64_t>(field.grid[axis] - 1, (leaf.lo[axis] + leaf.width()) >> kMaxDepth);
  }
  visitBaseCells(field, first, last, [&](const NodeBox& cell) {
    visitLeaves(field, cell, touches, [&](const NodeBox& other) {
      if (other.node != leaf.node) visit(other);
    });
  });
}

/// The Legendre polynomial L_i at −1, 0 or 1.
double legendreAtSign(int i, double x) {
  if (x != 0) return x > 0 || i % 2 == 0 ? 1 : -1;
  double value = i % 2 == 0 ? 1 : 0;
  for (int n = 2; n <= i && value != 0; n += 2) value *= -(n - 1.0) / n;
  return value;
}

/// A polynomial on a box. The coefficient of the Legendre product L_i(x) L_j(y) L_k(z) has the index
/// (i · n + j) · n + k, where n = degree + 1.
class Polynomial {
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

  /// Restricts the polynomial to a part of its box along an axis. The coordinate x in the old box and the
  /// coordinate s in the new box are related by x = scale · s + shift.
  void restrict(int axis, double scale, double shift) {
    if (scale == 1 && shift == 0) return;
    findRows(scale, shift);
    const int n = size_, along = axis == 0 ? n * n : axis == 1 ? n : 1;
    const int first = axis == 0 ? n : n * n, second = axis == 2 ? n : 1;  // strides of the two other axes
    for (int a = 0; a < n; ++a)
      for (int b = 0; a + b < n; ++b) {
        double* line = c_.data() + a * first + b * second;
        // Overwrite the line of coefficients in ascending order. This is possible because entry j of the result depends
        // only on entries j and above.
        for (int j = 0; j < n - a - b; ++j) {
          double sum = 0;
          for (int i = j; i < n - a - b; ++i) sum += rows_[i][j] * line[i * along];
          line[j * along] = sum;
        }
      }
  }

  void subtract(const Polynomial& other) {
    for (std::size_t n = 0; n < c_.size(); ++n) c_[n] -= other.c_[n];
  }

  /// The sum of the coefficients' magnitudes, an upper bound of the polynomial's magnitude on its box.
  double magnitude() const {
    double sum = 0;
    for (const double c : c_) sum += std::abs(c);
    return sum;
  }

  /// The value at a corner or at the centre of the box, whose coordinates are −1, 0 or 1 along all axes.
  double valueAtSigns(const Vector3& local) const {
    double value = 0;
    std::size_t next = 0;
    for (int i = 0; i < size_; ++i)
      for (int j = 0; j < size_; ++j)
        for (int k = 0; k < size_; ++k)
          value +=
              c_[next++] * legendreAtSign(i, local.x()) * legendreAtSign(j, local.y()) * legendreAtSign(k, local.z());
    return value;
  }

  /// Returns an upper bound, on the box, of the length of the polynomial's gradient with respect to other coordinates.
  /// `perUnit` holds, for each axis, the derivative of the box's local coordinate with respect to the other coordinate.
  double gradientBound(const Vector3& perUnit) {
    Vector3 gradient = Vector3::Zero();
    for (int i = 0; i < size_; ++i)
      for (int j = 0; i + j < size_; ++j)
        for (int k = 0; i + j + k < size_; ++k)
          gradient += std::abs(at(i, j, k)) * Vector3(i * (i + 1), j * (j + 1), k * (k + 1));
    return 0.5 * perUnit.cwiseProduct(gradient).norm();
  }

 private:
  /// Fills rows_ such that L_i(scale · s + shift) = Σ rows_[i][j] L_j(s). Uses the recurrence of L_i and the
  /// identity s L_j = ((j+1) L_{j+1} + j L_{j−1})/(2j+1).
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

/// Computes the blend zone bounds of leaves. Each thread has its own object of this class.
class LeafBounder {
 public:
  explicit LeafBounder(const Field& field)
      : field_(field.data()), extents_(field.lookupGrid().blendExtents), space_(field.data()) {}

  BlendZoneBounds bounds(const NodeBox& leaf) {
    double value = 0, gradient = 0;
    int smallest = smallestNeighbour(leaf);
    visitTouching(field_, leaf, [&](const NodeBox& other) {
      smallest = std::max(smallest, smallestNeighbour(other));
      if (isExact(leaf) || isExact(other)) {
        const Difference difference = exactDifference(leaf, other);
        value = std::max(value, difference.value);
        gradient = std::max(gradient, difference.gradient);
        return;
      }
      const double rounding = kFloatRounding * restrictBoth(leaf, other);
      ofOther_.subtract(ofLeaf_);
      value = std::max(value, ofOther_.magnitude() * (1 + kFloatRounding) + rounding);
      gradient = std::max(gradient, ofOther_.gradientBound(perUnit_) * (1 + kFloatRounding) + rounding);
    });
    return {static_cast<float>(value), static_cast<float>(gradient),
            static_cast<float>(std::ldexp(2 * field_.blend, leaf.depth - smallest))};
  }

 private:
  /// The depth of the smallest leaf among `leaf` and the leaves that touch one of its faces.
  int smallestNeighbour(const NodeBox& leaf) const {
    int deepest = leaf.depth;
    for (int axis = 0; axis < 3; ++axis)
      for (const bool upper : {false, true})
        if (const int depth = blend_extent::depth(extents_[leaf.node], axis, upper); depth != blend_extent::kDomainFace)
          deepest = std::max(deepest, depth);
    return deepest;
  }

  /// The part of a leaf into which the blending weight of another leaf may extend, in edges of the smallest possible
  /// cell.
  struct Overlap {
    Vector3 lo, hi;
  };

  Overlap overlap(const NodeBox& leaf, const NodeBox& other) const {
    const double extent = field_.blend * double(std::min(leaf.width(), other.width()));
    Overlap both;
    for (int axis = 0; axis < 3; ++axis) {
      both.lo[axis] = std::max(double(leaf.lo[axis]), double(other.lo[axis]) - extent);
      both.hi[axis] = std::min(double(leaf.lo[axis] + leaf.width()), double(other.lo[axis] + other.width()) + extent);
    }
    return both;
  }

  /// Restricts the polynomial of the leaf `from` to a part of it or of another leaf.
  void restrict(Polynomial& polynomial, const NodeBox& from, const Overlap& to, int size) const {
    assign(polynomial, from, size);
    const double half = 0.5 * double(from.width());
    for (int axis = 0; axis < 3; ++axis)
      polynomial.restrict(axis, 0.5 * (to.hi[axis] - to.lo[axis]) / half,
                          (0.5 * (to.lo[axis] + to.hi[axis]) - (double(from.lo[axis]) + half)) / half);
  }

  /// Restricts the polynomials of `leaf` and `other` to the part of `leaf` into which the blending weight of `other`
  /// may extend. Returns the sum of the magnitudes of all coefficients of the two restricted polynomials.
  double restrictBoth(const NodeBox& leaf, const NodeBox& other) {
    const int size = std::max(degree(leaf), degree(other)) + 1;
    const Overlap both = overlap(leaf, other);
    restrict(ofLeaf_, leaf, both, size);
    restrict(ofOther_, other, both, size);
    perUnit_ = double(leaf.width()) * (both.hi - both.lo).cwiseInverse();
    return ofLeaf_.magnitude() + ofOther_.magnitude();
  }

  /// Upper bounds of the difference of two leaves' functions, and of its gradient in local coordinates of the first.
  struct Difference {
    double value, gradient;
  };

  /// Bounds the difference where one or both leaves are exact.
  Difference exactDifference(const NodeBox& leaf, const NodeBox& other) {
    const Overlap both = overlap(leaf, other);
    const double value =
        isExact(leaf) && isExact(other) ? mostBeyond(leaf, other) : sampledDifference(leaf, other, both);
    return {value * (1 + kFloatRounding) + kFloatRounding * space_.diagonal,
            slope(leaf, leaf, both) + slope(other, leaf, both)};
  }

  /// An exact leaf knows the triangles that are nearest to its own box. At a distance from the box, the nearest of them
  /// is at most twice this distance farther than the nearest triangle of all.
  double mostBeyond(const NodeBox& leaf, const NodeBox& other) const {
    return 2 * field_.blend * double(std::min(leaf.width(), other.width())) * smallestCell().norm();
  }

  /// Estimates the greatest difference between an exact distance and a polynomial from its values at the corners and
  /// the centre of the overlap. A distance has no derivatives by which a polynomial that comes close to it could be
  /// compared with it everywhere.
  double sampledDifference(const NodeBox& leaf, const NodeBox& other, const Overlap& both) {
    constexpr double kMargin = 4;
    const NodeBox& exact = isExact(leaf) ? leaf : other;
    const NodeBox& polynomial = isExact(leaf) ? other : leaf;
    restrict(ofOther_, polynomial, both, degree(polynomial) + 1);
    double most = 0;
    for (int n = 0; n < 9; ++n) {
      const Vector3 local = n == 8 ? Vector3(0, 0, 0) : Vector3(n & 1 ? 1 : -1, n & 2 ? 1 : -1, n & 4 ? 1 : -1);
      const Vector3 at = 0.5 * (both.lo + both.hi) + 0.5 * local.cwiseProduct(both.hi - both.lo);
      const Vector3 x = space_.lo + at.cwiseProduct(smallestCell());
      const double distance = evaluateExactLeaf(field_.exact, field_.nodes[exact.node], x).value;
      most = std::max(most, std::abs(distance - ofOther_.valueAtSigns(local)));
    }
    return kMargin * most;
  }

  /// An upper bound of the gradient of a leaf's function in an overlap, in local coordinates of `leaf`.
  double slope(const NodeBox& from, const NodeBox& leaf, const Overlap& both) {
    if (isExact(from)) return 0.5 * double(leaf.width()) * smallestCell().maxCoeff() * (1 + kFloatRounding);
    restrict(ofOther_, from, both, degree(from) + 1);
    const Vector3 perUnit = double(leaf.width()) * (both.hi - both.lo).cwiseInverse();
    return ofOther_.gradientBound(perUnit) * (1 + kFloatRounding) + kFloatRounding * ofOther_.magnitude();
  }

  /// The edges of the smallest possible cell, world units.
  Vector3 smallestCell() const { return std::ldexp(1.0, -kMaxDepth) * space_.size.cwiseQuotient(space_.grid); }

  bool isExact(const NodeBox& leaf) const { return node::isExact(field_.nodes[leaf.node]); }
  int degree(const NodeBox& leaf) const { return node::degree(field_.nodes[leaf.node]); }

  void assign(Polynomial& polynomial, const NodeBox& leaf, int size) const {
    const std::uint64_t bits = field_.nodes[leaf.node];
    withCoefficients(field_, bits, [&](const auto* c) { polynomial.assign(c, node::degree(bits), size); });
  }

  const FieldData& field_;
  const std::vector<std::uint32_t>& extents_;
  GridSpace space_;
  Polynomial ofLeaf_, ofOther_;
  Vector3 perUnit_;  // derivative of the restricted box's local coordinates with respect to the leaf's
};

}  // namespace

std::vector<BlendZoneBounds> blendZoneBounds(const Field& field) {
  const FieldData& data = field.data();
  if (!(data.blend > 0)) return {};
  std::vector<NodeBox> leaves;
  visitBaseCells(data, {0, 0, 0}, {data.grid[0] - 1, data.grid[1] - 1, data.grid[2] - 1}, [&](const NodeBox& cell) {
    visitLeaves(
        data, cell, [](const NodeBox&) { return true; }, [&](const NodeBox& leaf) { leaves.push_back(leaf); });
  });
  std::vector<BlendZoneBounds> bounds(data.nodes.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 64), [&](const auto& range) {
    LeafBounder bounder(field);
    for (std::size_t n = range.begin(); n < range.end(); ++n) bounds[leaves[n].node] = bounder.bounds(leaves[n]);
  });
  return bounds;
}

}  // namespace hpsdf::render
