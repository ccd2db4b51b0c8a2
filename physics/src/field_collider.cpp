#include "hpsdf/physics/field_collider.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>

#include "exact_leaf_bound.h"
#include "hpsdf/detail/legendre_part.h"

namespace hpsdf::physics {
namespace {

constexpr std::size_t kMostCells = std::size_t{1} << 20;
constexpr double kUnits = 32;        // bounds are stored in 1/32 of the shortest cell edge; 16 bits reach 2048 edges
constexpr double kTolerance = 0.05;  // accepted error of bounds of polynomials, in shortest cell edges
constexpr double kRounding = 1e-12;  // upper bound of the relative rounding error of sums

/// A box in cells of the table.
struct Extent {
  std::array<double, 3> lower, upper;

  double width(int axis) const { return upper[axis] - lower[axis]; }
  int widestAxis() const {
    const auto widths = {width(0), width(1), width(2)};
    return static_cast<int>(std::ranges::max_element(widths) - widths.begin());
  }
  double middle(int axis) const { return (lower[axis] + upper[axis]) / 2; }
};

/// A part of an exact leaf, with the triangles that can be nearest to points of the part.
struct ExactPiece : Extent {
  ExactLeafBound::Positions triangles;
};

/// A polynomial in the local coordinates [−1, 1]³ of a box.
struct Piece : Extent {
  int degree;             ///< at least 1, so that linear terms exist
  std::vector<double> c;  ///< (degree + 1)³ coefficients, z fastest; 0 beyond the total degree
  double rest = 0;        ///< bound of the sum of terms that were left out

  double at(int i, int j, int k) const { return c[(std::size_t(i) * (degree + 1) + j) * (degree + 1) + k]; }
  double& at(int i, int j, int k) { return c[(std::size_t(i) * (degree + 1) + j) * (degree + 1) + k]; }

  /// Calls f(i, j, k) for all terms of a polynomial whose total degree is from `least` to `most`.
  template <typename F>
  static void forEachTerm(int least, int most, const F& f) {
    for (int i = 0; i <= most; ++i)
      for (int j = 0; i + j <= most; ++j)
        for (int k = std::max(0, least - i - j); i + j + k <= most; ++k) f(i, j, k);
  }

  /// Restricts the polynomial to a part of its box along one axis. `rows` comes from `legendreOfPart` for this part.
  void restrict(int axis, const detail::LegendreRows& rows) { detail::restrictToPart(c, degree, axis, rows); }

  /// Removes the terms of the highest degrees from the polynomial, as long as the magnitudes of all removed
  /// coefficients sum up to at most `tolerance`.
  void trim(double tolerance) {
    int kept = degree;
    double sum = 0, leftOut = 0;
    for (; kept > 1; --kept) {
      forEachTerm(kept, kept, [&](int i, int j, int k) { sum += std::abs(at(i, j, k)); });
      if (sum > tolerance) break;
      leftOut = sum;
    }
    if (kept == degree) return;
    rest += leftOut;
    Piece smaller{*this, kept, std::vector<double>(std::size_t(kept + 1) * (kept + 1) * (kept + 1), 0.0), rest};
    forEachTerm(0, kept, [&](int i, int j, int k) { smaller.at(i, j, k) = at(i, j, k); });
    *this = std::move(smaller);
  }

  /// Returns a bound of the magnitude of the sum of all terms of degree 2 or more, including rounding errors.
  double nonlinearBound() const {
    double high = rest, low = 0;
    forEachTerm(0, 1, [&](int i, int j, int k) { low += std::abs(at(i, j, k)); });
    forEachTerm(2, degree, [&](int i, int j, int k) { high += std::abs(at(i, j, k)); });
    return high + kRounding * (high + low);
  }
};

/// Finds lower bounds of the field in each cell of a grid.
class LowerBounds {
 public:
  LowerBounds(const Field& field, int depth, const std::array<std::int64_t, 3>& size, double tolerance)
      : field_(field),
        depth_(depth),
        size_(size),
        tolerance_(tolerance),
        least_(std::size_t(size[0] * size[1] * size[2]), std::numeric_limits<double>::infinity()) {}

  std::vector<double> find() {
    field_.forEachCell([&](const Cell& leaf) {
      const std::uint64_t bits = field_.data().nodes[leaf.id];
      if (node::isExact(bits)) {
        ExactLeafBound exact(field_.data().exact, bits);
        return bound(exact, {extentOf(leaf), exact.all()});
      }
      bound(pieceOf(leaf, bits));
    });
    return std::move(least_);
  }

 private:
  /// Greatest width, in cells, of a part of an exact leaf that is not divided. A cell with the widest blended zones on
  /// both sides has this width.
  static constexpr double kPartWidth = 1 + 2 * kMaxBlend;

  double edgeOf(const Cell& leaf) const { return std::ldexp(1.0, depth_ - leaf.depth); }

  /// Returns how far a leaf has a weight beyond one of its faces, in cells of the table.
  double extentBeyond(const Cell& leaf, int axis, bool upper) const {
    const double blend = field_.data().blend;
    if (blend == 0) return 0;
    const int depth = blend_extent::depth(field_.lookupGrid().blendExtents[leaf.id], axis, upper);
    return depth == blend_extent::kDomainFace ? 0 : blend * std::ldexp(1.0, depth_ - depth);
  }

  /// Returns the box in which a leaf has a weight. A blended field is a weighted mean of several leaves.
  Extent extentOf(const Cell& leaf) const {
    const GridFrame& frame = field_.lookupGrid().frame;
    Extent extent{};
    for (int axis = 0; axis < 3; ++axis) {
      const double from = leaf.box.min()[axis] - frame.lower[axis];
      const double index = std::round(std::ldexp(from / frame.size[axis] * frame.cells[axis], leaf.depth));
      extent.lower[axis] = index * edgeOf(leaf) - extentBeyond(leaf, axis, false);
      extent.upper[axis] = (index + 1) * edgeOf(leaf) + extentBeyond(leaf, axis, true);
    }
    return extent;
  }

  Box worldBox(const Extent& extent) const {
    const GridFrame& frame = field_.lookupGrid().frame;
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
      const double cell = frame.size[axis] / double(size_[axis]);
      box.min()[axis] = frame.lower[axis] + extent.lower[axis] * cell;
      box.max()[axis] = frame.lower[axis] + extent.upper[axis] * cell;
    }
    return box;
  }

  /// Returns a leaf's polynomial over the box in which the leaf has a weight.
  Piece pieceOf(const Cell& leaf, std::uint64_t bits) const {
    const FieldData& data = field_.data();
    const int stored = node::degree(bits), degree = std::max(stored, 1);
    Piece piece{extentOf(leaf), degree, std::vector<double>(std::size_t(degree + 1) * (degree + 1) * (degree + 1))};
    withCoefficients(data, bits, [&](const auto* c) {
      Piece::forEachTerm(0, stored, [&](int i, int j, int k) { piece.at(i, j, k) = *c++; });
    });
    if (data.blend == 0) return piece;
    for (int axis = 0; axis < 3; ++axis) {
      const double below = extentBeyond(leaf, axis, false), above = extentBeyond(leaf, axis, true);
      piece.restrict(axis,
                     detail::legendreOfPart((above - below) / edgeOf(leaf), piece.width(axis) / edgeOf(leaf), degree));
    }
    return piece;
  }

  /// Halves the piece recursively until its polynomial is almost linear. Then lowers the bounds of the grid
  /// cells that the piece overlaps.
  void bound(Piece piece) {
    piece.trim(tolerance_ / 8);
    const double nonlinear = piece.nonlinearBound();
    const int axis = piece.widestAxis();
    if (nonlinear <= tolerance_ || piece.width(axis) <= 1) return fill(piece, nonlinear);
    const double middle = piece.middle(axis);
    Piece upper = piece;
    upper.lower[axis] = middle;
    upper.restrict(axis, upperHalf_);
    bound(std::move(upper));
    piece.upper[axis] = middle;
    piece.restrict(axis, lowerHalf_);
    bound(std::move(piece));
  }

  /// Divides the part of an exact leaf recursively until it is hardly larger than a cell of the table. Then lowers the
  /// bounds of the cells that it overlaps.
  void bound(ExactLeafBound& exact, ExactPiece piece) {
    const int axis = piece.widestAxis();
    const bool isSmall = piece.width(axis) <= kPartWidth;
    const double least = exact.leastIn(worldBox(piece), isSmall, piece.triangles);
    if (isSmall) return fill(constantPiece(piece, least), 0);
    const double middle = std::round(piece.middle(axis));  // between cells, so that no part overlaps more than it must
    ExactPiece upper = piece;
    upper.lower[axis] = middle;
    bound(exact, std::move(upper));
    piece.upper[axis] = middle;
    bound(exact, std::move(piece));
  }

  static Piece constantPiece(const Extent& extent, double value) { return {extent, 1, {value, 0, 0, 0, 0, 0, 0, 0}}; }

  /// Lowers the bound of each cell that the piece overlaps to the smallest value of the piece's linear part
  /// in the cell, minus `nonlinear`.
  void fill(const Piece& piece, double nonlinear) {
    // For each axis, find the smallest value of the axis's linear term in each cell that the piece overlaps.
    std::array<std::int64_t, 3> first, count;
    std::array<double, 3> slope{};
    if (piece.degree > 0) slope = {piece.at(1, 0, 0), piece.at(0, 1, 0), piece.at(0, 0, 1)};
    for (int axis = 0; axis < 3; ++axis) {
      first[axis] = std::max<std::int64_t>(0, static_cast<std::int64_t>(std::floor(piece.lower[axis])));
      const auto last = std::min(size_[axis], static_cast<std::int64_t>(std::ceil(piece.upper[axis])));
      count[axis] = last - first[axis];
      linear_[axis].resize(static_cast<std::size_t>(std::max<std::int64_t>(0, count[axis])));
      for (std::int64_t i = 0; i < count[axis]; ++i) {
        const auto local = [&](double x) {
          const double inside = std::clamp(x, piece.lower[axis], piece.upper[axis]);
          return 2 * (inside - piece.lower[axis]) / piece.width(axis) - 1;
        };
        const auto cell = static_cast<double>(first[axis] + i);
        linear_[axis][i] = std::min(slope[axis] * local(cell), slope[axis] * local(cell + 1));
      }
    }
    for (std::int64_t z = 0; z < count[2]; ++z)
      for (std::int64_t y = 0; y < count[1]; ++y) {
        double* row = &least_[((first[2] + z) * size_[1] + first[1] + y) * size_[0] + first[0]];
        const double base = piece.at(0, 0, 0) - nonlinear + linear_[1][y] + linear_[2][z];
        for (std::int64_t x = 0; x < count[0]; ++x) row[x] = std::min(row[x], base + linear_[0][x]);
      }
  }

  const Field& field_;
  int depth_;
  std::array<std::int64_t, 3> size_;
  double tolerance_;
  std::vector<double> least_;
  std::array<std::vector<double>, 3> linear_;
  detail::LegendreRows lowerHalf_ = detail::legendreOfPart(-0.5, 0.5, kMaxDegree);
  detail::LegendreRows upperHalf_ = detail::legendreOfPart(0.5, 0.5, kMaxDegree);
};

using CellIndex = std::array<std::int64_t, 3>;

CellIndex cellIndexOf(std::int64_t n, const std::array<std::int64_t, 3>& size) {
  return {n % size[0], n / size[0] % size[1], n / size[0] / size[1]};
}

/// Returns for each cell the smallest of the values of the cell and its 26 neighbours.
std::vector<double> leastAround(std::vector<double> values, const std::array<std::int64_t, 3>& size) {
  std::int64_t stride = 1;
  for (int axis = 0; axis < 3; stride *= size[axis++]) {
    std::vector<double> least = values;
    for (std::int64_t n = 0; n < std::ssize(values); ++n) {
      const std::int64_t index = n / stride % size[axis];
      if (index > 0) least[n] = std::min(least[n], values[n - stride]);
      if (index + 1 < size[axis]) least[n] = std::min(least[n], values[n + stride]);
    }
    values = std::move(least);
  }
  return values;
}

/// Returns an upper bound of (length of a path) / (distance between its ends) for the shortest paths of steps between
/// neighbouring cells. For each order a, b, c of the axes, a path takes steps along axis a, diagonal steps along a and
/// b, and diagonal steps along all three axes. The path's length is a linear function of its end point. The norm of
/// this function's gradient bounds the ratio.
double worstDetour(const Vector3& cell) {
  double worst = 1;
  std::array<int, 3> order = {0, 1, 2};
  do {
    const double a = cell[order[0]], b = cell[order[1]], c = cell[order[2]];
    const double flat = std::hypot(a, b), whole = std::hypot(flat, c);
    worst = std::max(worst, Vector3(1, (flat - a) / b, (whole - flat) / c).norm());
  } while (std::next_permutation(order.begin(), order.end()));
  return worst;
}

/// Chamfer distance transform (Borgefors 1986): replaces the value of each cell by the smallest sum of
/// another cell's value and the length of the shortest path to that cell. Steps are shortened so that no
/// path is longer than the distance between its ends. One forward pass and one backward pass find the
/// shortest paths.
void distanceTransform(std::vector<double>& values, const std::array<std::int64_t, 3>& size, const Vector3& cell) {
  struct Step {
    CellIndex by;
    std::int64_t offset;
    double length;
  };
  const double shorten = (1 - kRounding) / worstDetour(cell);
  std::vector<Step> back;  // steps to neighbours that precede a cell in memory
  for (std::int64_t z = -1; z <= 0; ++z)
    for (std::int64_t y = -1; y <= 1; ++y)
      for (std::int64_t x = -1; x <= 1; ++x) {
        const std::int64_t offset = (z * size[1] + y) * size[0] + x;
        const bool before = z < 0 || (z == 0 && (y < 0 || (y == 0 && x < 0)));
        if (before)
          back.push_back(
              {{x, y, z}, offset, shorten * cell.cwiseProduct(Vector3(double(x), double(y), double(z))).norm()});
      }
  const auto visit = [&](std::int64_t n, int sign) {
    const CellIndex at = cellIndexOf(n, size);
    for (const Step& step : back) {
      bool within = true;
      for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t there = at[axis] + sign * step.by[axis];
        within &= there >= 0 && there < size[axis];
      }
      if (within) values[n] = std::min(values[n], values[n + sign * step.offset] + step.length);
    }
  };
  for (std::int64_t n = 0; n < std::ssize(values); ++n) visit(n, 1);
  for (std::int64_t n = std::ssize(values); n-- > 0;) visit(n, -1);
}

/// Returns the smallest value of the cells that touch the domain's sides.
double leastAtSides(const std::vector<double>& values, const std::array<std::int64_t, 3>& size) {
  double least = std::numeric_limits<double>::infinity();
  for (std::int64_t n = 0; n < std::ssize(values); ++n) {
    const CellIndex at = cellIndexOf(n, size);
    for (int axis = 0; axis < 3; ++axis)
      if (at[axis] == 0 || at[axis] + 1 == size[axis]) least = std::min(least, values[n]);
  }
  return least;
}

std::uint16_t roundedDown(double value, double unit) {
  constexpr double kMost = std::numeric_limits<std::uint16_t>::max();
  return static_cast<std::uint16_t>(std::min(value / unit, kMost));
}

}  // namespace

FieldCollider::FieldCollider(const Field& field) : field_(&field), depth_(0) {
  const GridFrame& frame = field.lookupGrid().frame;
  const std::size_t base = std::size_t(field.grid()[0]) * field.grid()[1] * field.grid()[2];
  while (depth_ < kMaxDepth && base << (3 * (depth_ + 1)) <= kMostCells) ++depth_;
  Vector3 cell;
  for (int axis = 0; axis < 3; ++axis) {
    size_[axis] = std::int64_t{field.grid()[axis]} << depth_;
    cell[axis] = frame.size[axis] / double(size_[axis]);
  }
  unit_ = cell.minCoeff() / kUnits;
  std::vector<double> within = LowerBounds(field, depth_, size_, kTolerance * cell.minCoeff()).find();
  wall_ = leastAtSides(within, size_);
  for (double& bound : within) bound = std::max(bound, 0.0);

  // Compute the bounds around each cell. A point of one cell and a point of another cell are at least as far apart as
  // the centre of the one cell and the nearest centre in the 3 × 3 × 3 neighbourhood of the other. Therefore, first
  // take the smallest value of each neighbourhood.
  std::vector<double> around = leastAround(within, size_);
  distanceTransform(around, size_, cell);
  if (wall_ > 0) wall_ = leastAtSides(around, size_);
  cells_.resize(within.size());
  for (std::size_t n = 0; n < cells_.size(); ++n)
    cells_[n] = {roundedDown(within[n], unit_), roundedDown(around[n], unit_)};
}

const FieldCollider::Cell& FieldCollider::cellAt(const Vector3& inDomain) const {
  const GridFrame& frame = field_->lookupGrid().frame;
  const double scale = double(std::uint32_t{1} << depth_);
  std::array<std::int64_t, 3> at;
  for (int axis = 0; axis < 3; ++axis) {
    // This expression must be identical to the expression by which the field finds the cell of a point.
    const double coordinate = (inDomain[axis] - frame.lower[axis]) / frame.size[axis] * frame.cells[axis];
    at[axis] = std::min(static_cast<std::int64_t>(coordinate * scale), size_[axis] - 1);
  }
  return cells_[(at[2] * size_[1] + at[1]) * size_[0] + at[0]];
}

// At a point x outside the domain the field is f(q) + |x − q|, where q is the point of the domain closest
// to x. At the domain's sides the field is at least `wall_`.

double FieldCollider::lowerBound(const Vector3& x) const {
  const Box& domain = field_->domain();
  const Vector3 closest = x.cwiseMax(domain.min()).cwiseMin(domain.max());
  const double bound = cellAt(closest).within * unit_;
  if (closest == x) return bound;
  const double beyond = (x - closest).norm();
  return std::max(bound > 0 ? bound + beyond : 0, wall_ + beyond);
}

// Returns the bound of the cell that contains x, or the greater of two bounds if x is outside the domain. A number b is
// a bound at x if the field is at least b − |x − y| at every point y with |x − y| < b. Let q be the point of the domain
// closest to x. The first bound is `around` at q. It holds because the points of the domain closest to x and to y are
// at most |x − y| apart. The second bound is `wall_` + |x − q|. For y outside the domain, it holds because y is at most
// |x − y| nearer to the domain than x. For y inside, the path from x to y crosses a side of the domain, where a `wall_`
// of 0 or more is a bound. If `wall_` is negative, the second bound is below |x − q|, and no y inside has |x − y| < b.
double FieldCollider::lowerBoundAround(const Vector3& x) const {
  const Box& domain = field_->domain();
  const Vector3 closest = x.cwiseMax(domain.min()).cwiseMin(domain.max());
  const double bound = cellAt(closest).around * unit_;
  return closest == x ? bound : std::max(bound, wall_ + (x - closest).norm());
}

}  // namespace hpsdf::physics
