#include "field/build/cell_bounds.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "basis/projection.h"
#include "field/build/cell_fit.h"
#include "field/query/evaluate.h"
#include "field/query/leaves.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"

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

/// L_i(shift + scale·t) = Σ_a row[i][a] L_a(t), a ≤ i, up to a degree; what is beyond is not set.
using Rows = std::array<std::array<double, kMaxDegree + 1>, kMaxDegree + 1>;

Rows legendreOfPart(double shift, double scale, int degree) {
  Rows row;
  row[0][0] = 1;
  for (int i = 0; i < degree; ++i) {
    std::array<double, kMaxDegree + 1> product;  // (shift + scale·t) · L_i, by the recurrence of t·L_a
    std::fill_n(product.begin(), i + 2, 0.0);
    for (int a = 0; a <= i; ++a) {
      product[a] += shift * row[i][a];
      product[a + 1] += scale * row[i][a] * (a + 1) / (2 * a + 1);
      if (a > 0) product[a - 1] += scale * row[i][a] * a / (2 * a + 1);
    }
    for (int a = 0; a <= i + 1; ++a)
      row[i + 1][a] = ((2 * i + 1) * product[a] - (a < i ? i * row[i - 1][a] : 0)) / (i + 1);
  }
  return row;
}

/// The polynomial's coefficients in a part's own coordinates, as a cube of (degree + 1)³ numbers of which those of a
/// greater total degree are 0, one axis after another.
std::vector<double> partCoefficients(std::vector<double> c, int degree, const std::array<const Rows*, 3>& rows) {
  const int n = degree + 1;
  const std::array<std::size_t, 3> stride = {std::size_t(n) * n, std::size_t(n), 1};
  for (int axis = 0; axis < 3; ++axis)
    for (int j = 0; j < n; ++j)
      for (int k = 0; j + k < n; ++k) {
        double* const line = &c[j * stride[(axis + 1) % 3] + k * stride[(axis + 2) % 3]];
        for (int a = 0; a + j + k < n; ++a) {  // upwards: the higher ones are still those of the whole
          double sum = 0;
          for (int i = a; i + j + k < n; ++i) sum += line[i * stride[axis]] * (*rows[axis])[i][a];
          line[a * stride[axis]] = sum;
        }
      }
  return c;
}

/// The lower and the upper half of an axis.
struct Halves {
  Rows below = legendreOfPart(-0.5, 0.5, kMaxDegree), above = legendreOfPart(0.5, 0.5, kMaxDegree);
};

/// Over an eighth of a leaf (number x + 2y + 4z).
Part partOf(const std::vector<double>& cube, int degree, const Box& box, int number, const Halves& halves) {
  std::array<const Rows*, 3> rows;
  Part part;
  for (int axis = 0; axis < 3; ++axis) {
    const bool upper = number >> axis & 1;
    rows[axis] = upper ? &halves.above : &halves.below;
    const double half = box.sizes()[axis] / 2;
    part.center[axis] = box.center()[axis] + (upper ? 0.5 : -0.5) * half;
    part.half[axis] = 0.5 * half;
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

/// A leaf's coefficients as a cube of at least (degree + 1)³.
std::vector<double> cubeOf(const FieldData& field, std::uint32_t leaf, int degree) {
  const std::uint64_t bits = field.nodes[leaf];
  const int n = degree + 1;
  std::vector<double> cube(std::size_t(n) * n * n, 0.0);
  std::visit(
      [&](const auto& c) {
        forEachCoefficient(node::degree(bits), [&](int i, int j, int k, int index) {
          cube[(std::size_t(i) * n + j) * n + k] = c[node::offset(bits) + index];
        });
      },
      field.coefficients);
  return cube;
}

/// Bounds of single leaves, of their own polynomials.
class BoundFinder {
 public:
  BoundFinder(const FieldData& field, const DistanceFunction& distance)
      : field_(field), frame_(gridFrame(field)), distance_(distance) {}

  CellBound operator()(const Leaf& leaf) const {
    const int degree = node::degree(field_.nodes[leaf.node]);
    const Box box = boxOf(frame_, leaf.depth, leaf.place);
    const std::vector<double> cube = cubeOf(field_, leaf.node, degree);
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
  const FieldData& field_;
  GridFrame frame_;
  const DistanceFunction& distance_;
  Halves halves_;
};

/// How far the polynomials of leaves are apart, at most.
struct Apart {
  double value = 0, slope = 0;

  void widen(const Apart& other) {
    value = std::max(value, other.value);
    slope = std::max(slope, other.slope);
  }
};

/// Of two leaves that touch, where both have a say: as far on either side of what they share as the smaller one's edge
/// times the width of its zone, neither reaching farther there.
Apart apartInZone(const FieldData& field, const Leaf& small, const Leaf& large) {
  const int degree = std::max(node::degree(field.nodes[small.node]), node::degree(field.nodes[large.node]));
  const int levels = small.depth - large.depth;
  std::array<Rows, 3> ofSmall, ofLarge;
  Vector3 half;
  for (int axis = 0; axis < 3; ++axis) {  // in edges of the small cell
    const std::int64_t smallAt = small.place[axis], largeAt = large.place[axis] << levels;
    const std::int64_t width = std::int64_t{1} << levels, wall = std::int64_t{field.grid[axis]} << small.depth;
    // counted from the small cell's lower side, so that nothing is lost far from the domain's corner
    const auto low = static_cast<double>(std::max<std::int64_t>(0, largeAt - smallAt));
    const auto high = static_cast<double>(std::min<std::int64_t>(1, largeAt + width - smallAt));
    const double from = std::max(low - field.blend, static_cast<double>(-smallAt));
    const double to = std::min(high + field.blend, static_cast<double>(wall - smallAt));
    half[axis] = (to - from) / 2;
    const auto rows = [&](double start, double edge) {
      return legendreOfPart((from + to - 2 * start) / edge - 1, 2 * half[axis] / edge, degree);
    };
    ofSmall[axis] = rows(0, 1);
    ofLarge[axis] = rows(static_cast<double>(largeAt - smallAt), static_cast<double>(width));
  }
  const std::vector<double> one =
      partCoefficients(cubeOf(field, small.node, degree), degree, {&ofSmall[0], &ofSmall[1], &ofSmall[2]});
  const std::vector<double> other =
      partCoefficients(cubeOf(field, large.node, degree), degree, {&ofLarge[0], &ofLarge[1], &ofLarge[2]});
  const Vector3 toWorld = half.cwiseProduct(cellSize(field, small.depth)).cwiseInverse();
  const int n = degree + 1;
  Apart apart;
  Vector3 slope = Vector3::Zero();
  for (int i = 0; i < n; ++i)
    for (int j = 0; i + j < n; ++j)
      for (int k = 0; i + j + k < n; ++k) {
        const std::size_t at = (std::size_t(i) * n + j) * n + k;
        const double difference = std::abs(one[at] - other[at]);
        apart.value += difference;
        slope += difference * Vector3(i * (i + 1) / 2.0, j * (j + 1) / 2.0, k * (k + 1) / 2.0).cwiseProduct(toWorld);
      }
  apart.slope = slope.norm();
  return apart;
}

/// Calls f(beside) for each leaf that touches one and is larger, or of its size and later in the octree: so each pair
/// comes once, though a larger leaf may lie in several directions.
template <typename F>
void forEachPair(const FieldData& field, const Leaf& leaf, const F& f) {
  std::array<std::uint32_t, 26> seen;
  std::size_t count = 0;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        const auto beside = notSmallerAt(field, leaf, {x, y, z});
        if (!beside || (beside->depth == leaf.depth && beside->node <= leaf.node)) continue;
        if (std::ranges::find(seen.begin(), seen.begin() + count, beside->node) != seen.begin() + count) continue;
        seen[count++] = beside->node;
        f(*beside);
      }
}

/// Depth of the deepest leaf among those that touch a leaf or one that touches it, by node.
std::vector<int> deepestAround(const FieldData& field, const std::vector<Leaf>& leaves) {
  std::vector<int> deepest(field.nodes.size(), 0);
  for (const Leaf& leaf : leaves) deepest[leaf.node] = leaf.depth;
  for (int ring = 0; ring < 2; ++ring) {
    const std::vector<int> inner = deepest;
    for (const Leaf& leaf : leaves)
      forEachPair(field, leaf, [&](const Leaf& beside) {
        deepest[leaf.node] = std::max(deepest[leaf.node], inner[beside.node]);
        deepest[beside.node] = std::max(deepest[beside.node], inner[leaf.node]);
      });
  }
  return deepest;
}

constexpr std::size_t kChunk = 4096;

void report(const Progress& progress, double fraction) { progress.at("finding bounds", fraction); }

/// In a blended leaf all that touch it have a say: f = f₀ + Σ vₙ (fₙ − f₀), f₀ being its own polynomial and vₙ weights
/// whose sum is 1 at most. Its error grows by how far the others are from f₀ where they have a say; its gradient by how
/// far theirs are, and by what the changing weights make of the distance.
void widenForBlending(FieldData& field, const std::vector<Leaf>& leaves, const Progress& progress) {
  std::vector<Apart> apart(field.nodes.size());
  for (std::size_t begin = 0; begin < leaves.size(); begin += kChunk) {
    report(progress, 0.5 + 0.5 * double(begin) / double(leaves.size()));
    struct Pair {
      std::uint32_t node;
      Apart apart;
    };
    std::vector<std::vector<Pair>> found(std::min(kChunk, leaves.size() - begin));
    tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t n) {
      const Leaf& leaf = leaves[begin + n];
      forEachPair(field, leaf, [&](const Leaf& beside) {
        found[n].push_back({beside.node, apartInZone(field, leaf, beside)});
      });
    });
    for (std::size_t n = 0; n < found.size(); ++n)
      for (const Pair& pair : found[n]) {
        apart[leaves[begin + n].node].widen(pair.apart);
        apart[pair.node].widen(pair.apart);
      }
  }
  // how far a neighbour reaches is decided by the smallest of its own neighbours
  const std::vector<int> deepest = deepestAround(field, leaves);
  // Σ ‖∇(w_n/Σw)‖ ≤ 2 Σ‖∇w_n‖ / Σw over eight leaves at most, one of which weighs 1/8 at least; a weight is a product
  // of three ramps, none steeper than 3/4 over the reach
  constexpr double kSlopes = 2 * 8 * 8 * 1.7320508075688773 * 0.75;
  const double rounding = kRounding * field.domain.diagonal().norm();
  for (const Leaf& leaf : leaves) {
    CellBound& bound = field.bounds[leaf.node];
    const Apart& others = apart[leaf.node];
    const double reach = field.blend * cellSize(field, deepest[leaf.node]).minCoeff();
    bound.error = roundedUp(double(bound.error) + others.value + rounding);
    bound.slope = roundedUp(double(bound.slope) + others.slope + kSlopes * (others.value + rounding) / reach);
  }
}

}  // namespace

std::uint64_t findBounds(FieldData& field, const DistanceFunction& distance, const Progress& progress) {
  field.bounds.clear();
  std::vector<CellBound> bounds(field.nodes.size());
  const std::vector<Leaf> leaves = leavesOf(field);
  const BoundFinder find(field, distance);
  const double share = field.blend > 0 ? 0.5 : 1;  // of the progress
  for (std::size_t begin = 0; begin < leaves.size(); begin += kChunk) {
    report(progress, share * double(begin) / double(leaves.size()));
    tbb::parallel_for(begin, std::min(begin + kChunk, leaves.size()),
                      [&](std::size_t n) { bounds[leaves[n].node] = find(leaves[n]); });
  }
  field.bounds = std::move(bounds);
  if (field.blend > 0) widenForBlending(field, leaves, progress);
  return BoundFinder::kCalls * leaves.size();
}

}  // namespace hpsdf
