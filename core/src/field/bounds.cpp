#include "field/bounds.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "basis/projection.h"
#include "field/cell_fit.h"
#include "field/evaluate.h"
#include "field/leaves.h"
#include "hpsdf/error.h"
#include "hpsdf/safe_distance.h"
#include "threads.h"

namespace hpsdf {
namespace {

// What roundings may add, in the size of the numbers at hand.
constexpr double kRounding = 1e-12;

/// A leaf's polynomial over an eighth of it: the same, in local coordinates of its own.
struct Part {
  Vector3 center, half;              ///< in the field's units
  double value = 0;                  ///< the linear polynomial's at the centre
  Vector3 gradient;                  ///< its gradient
  std::array<double, 3> squares{};   ///< coefficients of L_2 along each axis
  std::array<double, 3> products{};  ///< of yz, xz, xy
  double rest = 0;                   ///< of all of a higher degree than 2, at most
  Vector3 restGradient;              ///< the same of its derivatives
};

/// L_i(shift + scale·t) = Σ_a row[i][a] L_a(t), whatever the degree.
using Rows = std::array<std::array<double, kMaxDegree + 1>, kMaxDegree + 1>;

Rows legendreOfPart(double shift, double scale) {
  Rows row{};
  row[0][0] = 1;
  for (int i = 0; i < kMaxDegree; ++i) {
    std::array<double, kMaxDegree + 2> product{};  // (shift + scale·t) · L_i, by the recurrence of t·L_a
    for (int a = 0; a <= i; ++a) {
      product[a] += shift * row[i][a];
      product[a + 1] += scale * row[i][a] * (a + 1) / (2 * a + 1);
      if (a > 0) product[a - 1] += scale * row[i][a] * a / (2 * a + 1);
    }
    for (int a = 0; a <= i + 1; ++a)
      row[i + 1][a] = ((2 * i + 1) * product[a] - (i > 0 ? i * row[i - 1][a] : 0)) / (i + 1);
  }
  return row;
}

/// The polynomial's coefficients in a part's own coordinates, as a cube of (degree + 1)³ numbers, one axis after
/// another.
std::vector<double> partCoefficients(std::vector<double> c, int degree, const std::array<const Rows*, 3>& rows) {
  const int n = degree + 1;
  std::vector<double> out(c.size());
  std::array<std::size_t, 3> stride = {std::size_t(n) * n, std::size_t(n), 1};
  for (int axis = 0; axis < 3; ++axis) {
    std::fill(out.begin(), out.end(), 0.0);
    for (std::size_t at = 0; at < c.size(); ++at) {
      if (c[at] == 0) continue;
      const auto i = static_cast<int>(at / stride[axis] % n);
      const std::size_t line = at - i * stride[axis];
      for (int a = 0; a <= i; ++a) out[line + a * stride[axis]] += c[at] * (*rows[axis])[i][a];
    }
    std::swap(c, out);
  }
  return c;
}

/// The lower and the upper half of an axis, each reaching `beyond` of the whole over its end.
struct Halves {
  double scale;  ///< half of their width, where the whole is [-1, 1]
  Rows below, above;

  explicit Halves(double beyond)
      : scale(0.5 * (1 + 2 * beyond)), below(legendreOfPart(-scale, scale)), above(legendreOfPart(scale, scale)) {}
};

/// Over an eighth of a leaf (number x + 2y + 4z).
Part partOf(const std::vector<double>& cube, int degree, const Box& box, int number, const Halves& halves) {
  std::array<const Rows*, 3> rows;
  Part part;
  for (int axis = 0; axis < 3; ++axis) {
    const bool upper = number >> axis & 1;
    rows[axis] = upper ? &halves.above : &halves.below;
    const double half = box.sizes()[axis] / 2;
    part.center[axis] = box.center()[axis] + (upper ? halves.scale : -halves.scale) * half;
    part.half[axis] = halves.scale * half;
  }
  const std::vector<double> c = partCoefficients(cube, degree, rows);
  part.gradient.setZero();
  part.restGradient.setZero();
  const int n = degree + 1;
  for (int i = 0; i < n; ++i)
    for (int j = 0; i + j < n; ++j)
      for (int k = 0; i + j + k < n; ++k) {
        const double coefficient = c[(std::size_t(i) * n + j) * n + k];
        const std::array<int, 3> order = {i, j, k};
        const int total = i + j + k;
        if (total == 0) part.value = coefficient;
        for (int axis = 0; axis < 3; ++axis) {  // |L_i| ≤ 1 and |L_i'| ≤ i(i+1)/2 within [-1, 1]
          const double slope = order[axis] * (order[axis] + 1) / 2.0 * coefficient / part.half[axis];
          if (total == 1)
            part.gradient[axis] += slope;
          else
            part.restGradient[axis] += std::abs(slope);
        }
        if (total == 2) {
          const auto two = std::ranges::find(order, 2);
          if (two != order.end())
            part.squares[two - order.begin()] = coefficient;
          else
            part.products[std::ranges::find(order, 0) - order.begin()] = coefficient;
        }
        if (total > 2) part.rest += std::abs(coefficient);
      }
  return part;
}

/// Where Φ is asked for to bound it over a part: in its middle, and as far before and behind it, along the polynomial's
/// gradient, as an edge of the part's leaf is long. From a point far off on that line the ball without surface around
/// it is nearly a plane where it passes the part.
constexpr std::size_t kPlaces = 3;
constexpr double kFar = 1;  // bunny at τ=1e-6: with 2, 0.7 or 1.4 the median bound is 2.1, 1.03 and 1.2 times as great

std::array<Vector3, kPlaces> placesOf(const Part& part, const Box& domain, double edge) {
  std::array<Vector3, kPlaces> places;
  places.fill(part.center.cwiseMax(domain.min()).cwiseMin(domain.max()));
  const double steepness = part.gradient.norm();
  if (!(steepness > 0)) return places;
  const Vector3 step = kFar * edge / steepness * part.gradient;
  for (const int side : {1, 2}) {
    const Vector3 there = side == 1 ? Vector3(part.center + step) : Vector3(part.center - step);
    if (domain.contains(there)) places[side] = there;
  }
  return places;
}

/// At most over the part, of |f − Φ|: Φ lies between Φ(y) ∓ |x − y| for every y. What is linear in each coordinate is
/// greatest at corners, and so is what is convex along each axis; where squares bend the other way, by more than the
/// distance from y bends, it may be greater in the middle, by what a parabola rises there.
double errorBound(const Part& part, std::span<const Vector3> places, std::span<const double> distances) {
  double above = std::numeric_limits<double>::infinity(), below = above;  // of f over Φ, of Φ over f
  for (std::size_t p = 0; p < places.size(); ++p) {
    double over = -std::numeric_limits<double>::infinity(), under = over, farthest = 0;
    for (int corner = 0; corner < 8; ++corner) {
      std::array<double, 3> t;
      for (int axis = 0; axis < 3; ++axis) t[axis] = (corner >> axis & 1) ? 1 : -1;
      const Vector3 d = Vector3(t[0], t[1], t[2]).cwiseProduct(part.half);
      double value = part.value + part.gradient.dot(d);
      for (int axis = 0; axis < 3; ++axis)
        value += part.squares[axis] + part.products[axis] * t[(axis + 1) % 3] * t[(axis + 2) % 3];
      const double away = (part.center + d - places[p]).norm();
      farthest = std::max(farthest, away);
      over = std::max(over, value + away);
      under = std::max(under, away - value);
    }
    const Vector3 offset = part.center - places[p];
    const double nearest = (offset.cwiseAbs() - part.half).cwiseMax(0.0).norm();
    for (int axis = 0; axis < 3; ++axis) {
      const double square = part.half[axis] * part.half[axis];
      const double along = nearest > 0 ? std::min(1.0, (std::abs(offset[axis]) + part.half[axis]) / nearest) : 1;
      const double bend = (1 - along * along) / farthest * square;  // of the distance, at least
      const double own = 3 * part.squares[axis];
      over += std::max(0.0, -own - bend) / 2;
      under += std::max(0.0, own - bend) / 2;
    }
    above = std::min(above, over - distances[p]);
    below = std::min(below, under + distances[p]);
  }
  return std::max(above, below) + part.rest;
}

float roundedUp(double number) {
  const auto nearest = static_cast<float>(number);
  return double(nearest) >= number ? nearest : std::nextafter(nearest, std::numeric_limits<float>::infinity());
}

/// Bounds of single leaves, of their own polynomials as far as these reach.
class BoundFinder {
 public:
  BoundFinder(const FieldData& field, const DistanceFunction& distance)
      : field_(field), distance_(distance), halves_(field.blend) {}

  CellBound operator()(const Leaf& leaf) const {
    const std::uint64_t bits = field_.nodes[leaf.node];
    const int degree = node::degree(bits);
    const Box box = boxOf(leaf);
    const std::vector<double> cube = cubeOf(bits);
    std::array<Part, 8> parts;
    std::array<std::array<Vector3, kPlaces>, 8> places;
    std::array<Vector3, 8 * kPlaces> points;  // those of one kind side by side, as exact distances are fastest
    for (int number = 0; number < 8; ++number) {
      parts[number] = partOf(cube, degree, box, number, halves_);
      places[number] = placesOf(parts[number], field_.domain, box.sizes().maxCoeff());
      for (std::size_t p = 0; p < kPlaces; ++p) points[8 * p + number] = places[number][p];
    }
    std::array<double, points.size()> distances;
    distance_(points, distances);
    CellBound bound;
    double error = 0, slope = 0;
    for (int number = 0; number < 8; ++number) {
      std::array<double, kPlaces> ofPart;
      for (std::size_t p = 0; p < kPlaces; ++p) ofPart[p] = distances[8 * p + number];
      for (const double value : ofPart)
        if (!std::isfinite(value)) throw Error("bounds: the signed distance is not finite within the domain");
      const Part& part = parts[number];
      error = std::max(error, errorBound(part, places[number], ofPart));
      slope = std::max(slope, (part.gradient.cwiseAbs() + part.restGradient).norm());
    }
    const double size = field_.domain.diagonal().norm();
    bound.error = roundedUp(error + kRounding * size);
    bound.slope = roundedUp(slope * (1 + kRounding));
    return bound;
  }

  static constexpr std::uint64_t kCalls = 8 * kPlaces;

 private:
  Box boxOf(const Leaf& leaf) const {
    const Vector3 size = cellSize(field_, leaf.depth);
    Vector3 lo;
    for (int axis = 0; axis < 3; ++axis) lo[axis] = field_.domain.min()[axis] + double(leaf.place[axis]) * size[axis];
    return Box(lo, lo + size);
  }

  std::vector<double> cubeOf(std::uint64_t bits) const {
    const int degree = node::degree(bits), n = degree + 1;
    std::vector<double> cube(std::size_t(n) * n * n, 0.0);
    std::visit(
        [&](const auto& c) {
          forEachCoefficient(degree, [&](int i, int j, int k, int index) {
            cube[(std::size_t(i) * n + j) * n + k] = c[node::offset(bits) + index];
          });
        },
        field_.coefficients);
    return cube;
  }

  const FieldData& field_;
  const DistanceFunction& distance_;
  Halves halves_;  ///< of a leaf's axes, as far as blending makes it reach
};

/// The greater of both for each pair of leaves that touch, which takes each into account for the other.
template <typename T, typename Take>
std::vector<T> takenFromNeighbours(const FieldData& field, const std::vector<Leaf>& leaves, const std::vector<T>& own,
                                   const Take& take) {
  std::vector<T> taken = own;
  for (const Leaf& leaf : leaves)
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z)
          if (const auto beside = notSmallerAt(field, leaf, {x, y, z})) {
            take(taken[leaf.node], own[beside->node]);
            take(taken[beside->node], own[leaf.node]);
          }
  return taken;
}

/// In a blended leaf all that touch it have a say. Its error is a mean of theirs. Its gradient is a mean of theirs too,
/// and what the changing weights add: their slopes times how far two of the leaves are apart.
void takeNeighboursIn(FieldData& field, const std::vector<Leaf>& leaves) {
  field.bounds = takenFromNeighbours(field, leaves, field.bounds, [](CellBound& to, const CellBound& from) {
    to = {std::max(to.error, from.error), std::max(to.slope, from.slope)};
  });
  // how far a neighbour reaches is decided by the smallest of its own neighbours
  std::vector<int> deepest(field.nodes.size(), 0);
  for (const Leaf& leaf : leaves) deepest[leaf.node] = leaf.depth;
  for (int ring = 0; ring < 2; ++ring)
    deepest = takenFromNeighbours(field, leaves, deepest, [](int& to, int from) { to = std::max(to, from); });
  // Σ ‖∇(w_n/Σw)‖ ≤ 2 Σ‖∇w_n‖ / Σw over eight leaves at most, one of which weighs 1/8 at least; a weight is a product
  // of three ramps, none steeper than 3/4 over the reach
  constexpr double kSlopes = 2 * 8 * 8 * 1.7320508075688773 * 0.75;
  for (const Leaf& leaf : leaves) {
    CellBound& bound = field.bounds[leaf.node];
    const double reach = field.blend * cellSize(field, deepest[leaf.node]).minCoeff();
    bound.slope = roundedUp(double(bound.slope) + kSlopes * 2 * double(bound.error) / reach);
  }
}

}  // namespace

std::uint64_t findBounds(FieldData& field, const DistanceFunction& distance, const Progress& progress) {
  field.bounds.clear();
  std::vector<CellBound> bounds(field.nodes.size());
  const std::vector<Leaf> leaves = leavesOf(field);
  const BoundFinder find(field, distance);
  constexpr std::size_t kChunk = 4096;
  for (std::size_t begin = 0; begin < leaves.size(); begin += kChunk) {
    if (progress.cancelled && progress.cancelled()) throw Cancelled();
    if (progress.report) progress.report("finding bounds", double(begin) / double(leaves.size()));
    tbb::parallel_for(begin, std::min(begin + kChunk, leaves.size()),
                      [&](std::size_t n) { bounds[leaves[n].node] = find(leaves[n]); });
  }
  field.bounds = std::move(bounds);
  if (field.blend > 0) takeNeighboursIn(field, leaves);
  return BoundFinder::kCalls * leaves.size();
}

Field withBounds(const Field& field, const DistanceFunction& distance, int threads, const Progress& progress) {
  FieldData data = field.data();
  data.metadata.exactEvaluations += withThreads(threads, [&] { return findBounds(data, distance, progress); });
  return Field(std::move(data));
}

}  // namespace hpsdf
