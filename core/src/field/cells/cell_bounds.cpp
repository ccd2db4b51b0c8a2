#include "field/cells/cell_bounds.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "basis/coefficient_cube.h"
#include "basis/projection.h"
#include "field/cells/cell_fit.h"
#include "field/cells/exact_bounds.h"
#include "field/cells/part_bounds.h"
#include "field/query/evaluate.h"
#include "field/query/leaves.h"
#include "hpsdf/detail/legendre_part.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {
namespace {

using basis::cubeFrom;
using basis::cubeIndex;
using basis::partCoefficients;

// Upper bound of the accumulated rounding errors, relative to the magnitude of the numbers involved.
constexpr double kRounding = 1e-12;

/// Transformations of Legendre coefficients from the local coordinates of a leaf to the lower and the upper half of a
/// box, along each axis.
using Halves = std::array<std::array<const LegendreRows*, 2>, 3>;

/// Returns the coefficients of a leaf's polynomial in local coordinates of one octant of a box.
std::vector<double> octantCoefficients(const std::vector<double>& cube, int degree, int number, const Halves& halves) {
  std::array<const LegendreRows*, 3> rows;
  for (int axis = 0; axis < 3; ++axis) rows[axis] = halves[axis][number >> axis & 1];
  return partCoefficients(cube, degree, rows);
}

/// Returns a leaf's polynomial over one octant of a box. The octant's number is x + 2y + 4z. `cube` holds the
/// coefficients in local coordinates of the octant.
Part octantOf(const std::vector<double>& cube, int degree, const Box& box, int number) {
  const Vector3 half = box.sizes() / 4;
  Vector3 center = box.center();
  for (int axis = 0; axis < 3; ++axis) center[axis] += (number >> axis & 1) != 0 ? half[axis] : -half[axis];
  return partOf(cube, degree, center, half);
}

/// Number of points at which the exact distance Φ is evaluated for one part of a cell: the part's centre, and two
/// points one cell edge away from the centre, on either side along the polynomial's gradient. Each point y gives the
/// bounds Φ(y) ± |x − y| of Φ(x). The farther away y is, the more nearly these bounds are linear in x over the part.
constexpr std::size_t kPointsPerPart = 3;
/// Distance of the two outer points from the part's centre, in cell edges. With 0.7, 1.4 and 2 instead of 1, the median
/// error bound for the mesh bunny is 1.03, 1.2 and 2.1 times as great.
constexpr double kSideDistance = 1;

std::array<Vector3, kPointsPerPart> pointsOf(const Part& part, const Box& domain, double edge) {
  std::array<Vector3, kPointsPerPart> partPoints;
  partPoints.fill(part.center.cwiseMax(domain.min()).cwiseMin(domain.max()));
  const double steepness = part.gradient.norm();
  if (!(steepness > 0)) return partPoints;
  const Vector3 step = kSideDistance * edge / steepness * part.gradient;
  for (const int side : {1, 2}) {
    const Vector3 point = side == 1 ? Vector3(part.center + step) : Vector3(part.center - step);
    if (domain.contains(point)) partPoints[side] = point;
  }
  return partPoints;
}

/// Returns an upper bound of the error |f − Φ| over a part with polynomial f. For every point y, the exact distance
/// Φ(x) lies between Φ(y) − |x − y| and Φ(y) + |x − y|.
double errorBound(const Part& part, std::span<const Vector3> partPoints, std::span<const double> distances) {
  double above = std::numeric_limits<double>::infinity(), below = above;  // bounds of f − Φ and of Φ − f
  for (std::size_t p = 0; p < partPoints.size(); ++p) {
    above = std::min(above, coneBound(part, 1, partPoints[p]) - distances[p]);
    below = std::min(below, coneBound(part, -1, partPoints[p]) + distances[p]);
  }
  return std::max(above, below);
}

/// Proves that a polynomial is within the allowed error.
class Proof {
 public:
  Proof(const CellPolynomial& polynomial, const AllowedError& allowed, double rounding,
        std::atomic<std::uint64_t>& evaluations)
      : polynomial_(polynomial), allowed_(allowed), rounding_(rounding), evaluations_(evaluations) {
    halves_.fill({&below_, &above_});
  }

  bool holds() const {
    constexpr int kHalvings = 2;
    const std::vector<double> cube = cubeFrom(polynomial_.coefficients.data(), polynomial_.degree, polynomial_.degree);
    return holdsIn(cube, polynomial_.cell, kHalvings);
  }

 private:
  /// Returns true if the error is proven to be within the allowed error in all octants of a box. `cube` holds the
  /// polynomial's coefficients in local coordinates of the box.
  bool holdsIn(const std::vector<double>& cube, const Box& box, int halvings) const {
    const int degree = polynomial_.degree;
    for (int number = 0; number < 8; ++number) {
      const std::vector<double> c = octantCoefficients(cube, degree, number, halves_);
      const Part part = octantOf(c, degree, box, number);
      if (isWithin(part, box.sizes().maxCoeff())) continue;
      const Box octant(part.center - part.half, part.center + part.half);
      if (halvings == 0 || !holdsIn(c, octant, halvings - 1)) return false;
    }
    return true;
  }

  bool isWithin(const Part& part, double edge) const {
    const auto points = pointsOf(part, polynomial_.domain, edge);
    std::array<double, kPointsPerPart> distances;
    polynomial_.distance(points, distances);
    evaluations_ += points.size();
    const double least = std::max(0.0, std::abs(distances[0]) - part.half.norm());
    return errorBound(part, points, distances) + rounding_ <= allowed_.at(least);
  }

  const CellPolynomial& polynomial_;
  const AllowedError& allowed_;
  double rounding_;
  std::atomic<std::uint64_t>& evaluations_;
  LegendreRows below_ = legendreOfPart(-0.5, 0.5, kMaxDegree), above_ = legendreOfPart(0.5, 0.5, kMaxDegree);
  Halves halves_;
};

float roundedUp(double number) {
  const auto nearest = static_cast<float>(number);
  return double(nearest) >= number ? nearest : std::nextafter(nearest, std::numeric_limits<float>::infinity());
}

/// Returns the coefficients of a leaf as a cube of (degree + 1)³ numbers. `degree` is at least the leaf's
/// degree.
std::vector<double> cubeOf(const FieldData& field, std::uint32_t leaf, int degree) {
  const std::uint64_t bits = field.nodes[leaf];
  return withCoefficients(field, bits, [&](const auto* c) { return cubeFrom(c, node::degree(bits), degree); });
}

/// The box in which two touching leaves both have a blending weight. It extends on either side of the leaves' common
/// face, edge or corner by the edge of the smaller leaf times the blend width.
struct Zone {
  Vector3 from, to;  ///< relative to the small leaf's lower corner, in edges of the small leaf
  /// Lower corner and edge of the large leaf, in the same coordinates. Relative positions are exact even far from the
  /// domain's corner.
  Vector3 largeAt;
  double largeEdge;
};

Zone zoneBetween(const FieldData& field, const query::OctreeNode& small, const query::OctreeNode& large) {
  const int levels = small.depth - large.depth;
  const std::int64_t width = std::int64_t{1} << levels;
  Zone zone;
  zone.largeEdge = static_cast<double>(width);
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t smallAt = small.cellIndex[axis], largeAt = large.cellIndex[axis] << levels;
    const std::int64_t wall = std::int64_t{field.grid[axis]} << small.depth;
    const auto low = static_cast<double>(std::max<std::int64_t>(0, largeAt - smallAt));
    const auto high = static_cast<double>(std::min<std::int64_t>(1, largeAt + width - smallAt));
    zone.from[axis] = std::max(low - field.blend, static_cast<double>(-smallAt));
    zone.to[axis] = std::min(high + field.blend, static_cast<double>(wall - smallAt));
    zone.largeAt[axis] = static_cast<double>(largeAt - smallAt);
  }
  return zone;
}

/// Upper bounds of |f − Φ| and ‖∇f‖ for the field f of one leaf.
struct Bounds {
  double error = 0, slope = 0;
};

/// Evaluations of Φ by which the error of a leaf is bounded in its box, and in a zone that it shares with an exact
/// leaf.
constexpr std::uint64_t kEvaluationsOfLeaf = 48, kEvaluationsOfZone = 24;

/// Returns the box in which a distance may be evaluated. A distance to triangles may be evaluated everywhere, and
/// points beyond the domain bound it well.
Box whereKnown(const Box& domain, const DistanceFunction& distance) {
  if (distance.triangleSearch() == nullptr) return domain;
  return Box(domain.min() - domain.sizes(), domain.max() + domain.sizes());
}

/// Computes bounds of the fields of single leaves, without regard to blending.
class BoundFinder {
 public:
  BoundFinder(const FieldData& field, const DistanceFunction& distance)
      : field_(field),
        frame_(query::gridFrame(field)),
        distance_(distance),
        exact_(field, distance),
        known_(whereKnown(field.domain, distance)),
        rounding_(kRounding * field.domain.diagonal().norm()) {}

  /// Finds the bounds of leaves, each in its own box, and stores them by node. It is fastest for leaves that are close
  /// to each other.
  void operator()(std::span<const query::OctreeNode> leaves, std::vector<CellBound>& bounds) const {
    const auto store = [&](std::uint32_t node, const Bounds& found) {
      bounds[node].error = roundedUp(found.error + rounding_);
      bounds[node].slope = roundedUp(found.slope * (1 + kRounding));
    };
    std::vector<BoxPolynomial> polynomials;
    std::vector<std::uint32_t> nodes;
    for (const query::OctreeNode& leaf : leaves) {
      if (isExact(leaf)) {
        store(leaf.node, {exact_.error(leaf), 1});
        continue;
      }
      const int degree = node::degree(field_.nodes[leaf.node]);
      const Box box = query::cellBox(frame_, leaf.depth, leaf.cellIndex);
      polynomials.push_back(polynomialIn(box, cubeOf(field_, leaf.node, degree), degree));
      nodes.push_back(leaf.node);
    }
    const std::vector<Bounds> found = boundsOf(polynomials, kEvaluationsOfLeaf);
    for (std::size_t n = 0; n < nodes.size(); ++n) store(nodes[n], found[n]);
  }

  /// Bounds the errors of exact leaves in all zones, which `inZone` needs.
  void boundExactLeavesInZones(const std::vector<query::OctreeNode>& leaves) {
    exactErrorAround_.resize(field_.nodes.size());
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t n) {
      if (isExact(leaves[n])) exactErrorAround_[leaves[n].node] = exact_.errorAround(leaves[n]);
    });
  }

  /// Returns the bounds of a leaf in the zone that it shares with another leaf. `at` and `edge` are the leaf's lower
  /// corner and edge in the coordinates of the zone, and `small` is the smaller one of the two leaves.
  Bounds inZone(const Zone& zone, const query::OctreeNode& leaf, const Vector3& at, double edge,
                const query::OctreeNode& small) const {
    if (isExact(leaf)) return {exactErrorAround_[leaf.node] + rounding_, 1 + kRounding};
    std::array<LegendreRows, 3> rows;
    std::array<double, 3> lower, upper;
    const int degree = node::degree(field_.nodes[leaf.node]);
    for (int axis = 0; axis < 3; ++axis) {
      const double centre = (zone.from[axis] + zone.to[axis] - 2 * at[axis]) / edge - 1;
      rows[axis] = legendreOfPart(centre, (zone.to[axis] - zone.from[axis]) / edge, degree);
      const auto corner = static_cast<double>(small.cellIndex[axis]);
      lower[axis] = std::ldexp(corner + zone.from[axis], -small.depth);
      upper[axis] = std::ldexp(corner + zone.to[axis], -small.depth);
    }
    const Box box(query::worldPoint(frame_, lower), query::worldPoint(frame_, upper));
    const BoxPolynomial polynomial = polynomialIn(
        box, partCoefficients(cubeOf(field_, leaf.node, degree), degree, {&rows[0], &rows[1], &rows[2]}), degree);
    const Bounds found = boundsOf({&polynomial, 1}, kEvaluationsOfZone).front();
    return {found.error + rounding_, found.slope * (1 + kRounding)};
  }

  bool isExact(const query::OctreeNode& leaf) const { return node::isExact(field_.nodes[leaf.node]); }

  std::uint64_t evaluations() const { return evaluations_; }

 private:
  /// Returns a polynomial over a box. `cube` holds its coefficients in local coordinates of the box.
  static BoxPolynomial polynomialIn(const Box& box, std::vector<double> cube, int degree) {
    const Part part = partOf(cube, degree, box.center(), box.sizes() / 2);
    return {std::move(cube), degree, part};
  }

  std::vector<Bounds> boundsOf(std::span<const BoxPolynomial> polynomials, std::uint64_t mostEvaluations) const {
    std::vector<Bounds> bounds;
    for (const ErrorBound& found : boundErrors(polynomials, {mostEvaluations, distance_, known_, below_, above_})) {
      evaluations_ += found.evaluations;
      bounds.push_back({found.error, found.slope});
    }
    return bounds;
  }

  const FieldData& field_;
  GridFrame frame_;
  const DistanceFunction& distance_;
  ExactBounds exact_;
  Box known_;                             ///< where Φ may be evaluated
  std::vector<double> exactErrorAround_;  ///< by node: see `ExactBounds::errorAround`
  double rounding_;                       ///< bound of the rounding errors of values
  LegendreRows below_ = legendreOfPart(-0.5, 0.5, kMaxDegree), above_ = legendreOfPart(0.5, 0.5, kMaxDegree);
  mutable std::atomic<std::uint64_t> evaluations_ = 0;
};

/// Upper bounds of how a leaf changes where its neighbours are blended with it.
struct Disagreement {
  double value = 0;  ///< difference between the fields of two leaves
  double error = 0;  ///< growth of |f − Φ|
  double slope = 0;  ///< growth of ‖∇f‖, without regard to the slopes of the blending weights

  void widen(const Disagreement& other) {
    value = std::max(value, other.value);
    error = std::max(error, other.error);
    slope = std::max(slope, other.slope);
  }
};

/// Bounds the difference between the polynomials of two touching leaves in their common zone.
Disagreement disagreementInZone(const FieldData& field, const query::OctreeNode& small,
                                const query::OctreeNode& large) {
  const int degree = std::max(node::degree(field.nodes[small.node]), node::degree(field.nodes[large.node]));
  const Zone zone = zoneBetween(field, small, large);
  const Vector3 half = (zone.to - zone.from) / 2;
  std::array<LegendreRows, 3> smallRows, largeRows;
  for (int axis = 0; axis < 3; ++axis) {  // lengths are in edges of the small cell
    const auto rows = [&](double start, double edge) {
      return legendreOfPart((zone.from[axis] + zone.to[axis] - 2 * start) / edge - 1, 2 * half[axis] / edge, degree);
    };
    smallRows[axis] = rows(0, 1);
    largeRows[axis] = rows(zone.largeAt[axis], zone.largeEdge);
  }
  const std::vector<double> one =
      partCoefficients(cubeOf(field, small.node, degree), degree, {&smallRows[0], &smallRows[1], &smallRows[2]});
  const std::vector<double> other =
      partCoefficients(cubeOf(field, large.node, degree), degree, {&largeRows[0], &largeRows[1], &largeRows[2]});
  const Vector3 toWorld = half.cwiseProduct(query::cellSize(field, small.depth)).cwiseInverse();
  Disagreement disagreement;
  Vector3 slope = Vector3::Zero();
  basis::forEachCoefficient(degree, [&](int i, int j, int k, int) {
    const std::size_t at = cubeIndex(i, j, k, degree);
    const double difference = std::abs(one[at] - other[at]);
    disagreement.value += difference;
    slope += difference * Vector3(i * (i + 1) / 2.0, j * (j + 1) / 2.0, k * (k + 1) / 2.0).cwiseProduct(toWorld);
  });
  disagreement.error = disagreement.value;
  disagreement.slope = slope.norm();
  return disagreement;
}

/// Bounds how a leaf with the bounds `own` changes in a zone where a leaf with the bounds `other` is blended with it.
/// The blended field and its gradient, without the slopes of the weights, are weighted means of both leaves. Hence
/// neither |f − Φ| nor ‖∇f‖ exceeds the greater one of the two bounds.
Disagreement disagreementBy(const CellBound& own, const Bounds& other) {
  return {.value = double(own.error) + other.error,
          .error = std::max(0.0, other.error - double(own.error)),
          .slope = std::max(0.0, other.slope - double(own.slope))};
}

/// The disagreements of two touching leaves.
struct PairOfLeaves {
  std::uint32_t node;  ///< the neighbour
  Disagreement ofLeaf, ofNeighbour;
};

/// Bounds how two touching leaves change each other. `neighbour` is at least as large as `leaf`. Where both are
/// polynomials, their difference is known better than the difference of each from Φ.
PairOfLeaves disagreementsOf(const FieldData& field, const BoundFinder& find, const query::OctreeNode& leaf,
                             const query::OctreeNode& neighbour) {
  if (!find.isExact(leaf) && !find.isExact(neighbour)) {
    const Disagreement both = disagreementInZone(field, leaf, neighbour);
    return {neighbour.node, both, both};
  }
  const Zone zone = zoneBetween(field, leaf, neighbour);
  const Bounds ofLeaf = find.inZone(zone, leaf, Vector3::Zero(), 1, leaf);
  const Bounds ofNeighbour = find.inZone(zone, neighbour, zone.largeAt, zone.largeEdge, leaf);
  return {neighbour.node, disagreementBy(field.bounds[leaf.node], ofNeighbour),
          disagreementBy(field.bounds[neighbour.node], ofLeaf)};
}

/// Calls f(neighbour) for each leaf that touches `leaf` and is larger, or is of equal size and comes later in
/// the octree. Each pair of touching leaves is visited only once, even if a larger leaf touches `leaf` in
/// several directions.
template <typename F>
void forEachPair(const FieldData& field, const query::OctreeNode& leaf, const F& f) {
  std::array<std::uint32_t, 26> seen;
  std::size_t count = 0;
  query::forEachNeighbour(field, leaf, [&](const query::OctreeNode& neighbour) {
    if (neighbour.depth == leaf.depth && neighbour.node < leaf.node) return;
    if (std::find(seen.begin(), seen.begin() + count, neighbour.node) != seen.begin() + count) return;
    seen[count++] = neighbour.node;
    f(neighbour);
  });
}

/// Returns for each leaf, by node index, the depth of the deepest leaf among the leaf, its neighbours and their
/// neighbours.
std::vector<int> deepestAround(const FieldData& field, const std::vector<query::OctreeNode>& leaves) {
  std::vector<int> deepest(field.nodes.size(), 0);
  for (const query::OctreeNode& leaf : leaves) deepest[leaf.node] = leaf.depth;
  for (int ring = 0; ring < 2; ++ring) {
    const std::vector<int> inner = deepest;
    for (const query::OctreeNode& leaf : leaves)
      forEachPair(field, leaf, [&](const query::OctreeNode& neighbour) {
        deepest[leaf.node] = std::max(deepest[leaf.node], inner[neighbour.node]);
        deepest[neighbour.node] = std::max(deepest[neighbour.node], inner[leaf.node]);
      });
  }
  return deepest;
}

constexpr std::size_t kLeavesPerStep = 4096;
/// Leaves whose errors are bounded together. Their points make batches of 32, in which a distance takes less time than
/// in batches of eight. With eight leaves at once, a field of high degrees takes a fifth longer.
constexpr std::size_t kLeavesAtOnce = 4;

void report(const Progress& progress, double fraction) { progress.update("finding bounds", fraction); }

/// Widens the bounds of leaves to include blending. In a blended leaf f = f₀ + Σ vₙ (fₙ − f₀). Here f₀ is the
/// leaf's own polynomial or exact distance, the fₙ are those of touching leaves, and the weights vₙ sum to at most 1.
/// Where all are polynomials, the error bound grows by the greatest |fₙ − f₀| in the blend zones. The slope bound grows
/// by the greatest difference of gradients and by |fₙ − f₀| times the slope of the weights.
void widenForBlending(FieldData& field, BoundFinder& find, const std::vector<query::OctreeNode>& leaves,
                      const Progress& progress) {
  find.boundExactLeavesInZones(leaves);
  std::vector<Disagreement> disagreement(field.nodes.size());
  for (std::size_t begin = 0; begin < leaves.size(); begin += kLeavesPerStep) {
    report(progress, 0.5 + 0.5 * double(begin) / double(leaves.size()));
    std::vector<std::vector<PairOfLeaves>> found(std::min(kLeavesPerStep, leaves.size() - begin));
    tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t n) {
      const query::OctreeNode& leaf = leaves[begin + n];
      forEachPair(field, leaf, [&](const query::OctreeNode& neighbour) {
        found[n].push_back(disagreementsOf(field, find, leaf, neighbour));
      });
    });
    for (std::size_t n = 0; n < found.size(); ++n)
      for (const PairOfLeaves& pair : found[n]) {
        disagreement[leaves[begin + n].node].widen(pair.ofLeaf);
        disagreement[pair.node].widen(pair.ofNeighbour);
      }
  }
  // Find the deepest leaf around each leaf, because weights are steepest in the narrowest blend zone. The blend zones
  // of a neighbour depend on the neighbour's own neighbours.
  const std::vector<int> deepest = deepestAround(field, leaves);
  // Bound the slope of the normalized weights of at most eight leaves n: Σ ‖∇(w_n/Σw)‖ ≤ 2 (Σ‖∇w_n‖) / Σw. At least one
  // leaf has a weight of 1/8 or more. A weight is a product of three ramps. The slope of a ramp is at most 3/4 divided
  // by the half width of the blend zone.
  constexpr double kSlopes = 2 * 8 * 8 * 1.7320508075688773 * 0.75;
  const double rounding = kRounding * field.domain.diagonal().norm();
  for (const query::OctreeNode& leaf : leaves) {
    CellBound& bound = field.bounds[leaf.node];
    const Disagreement& others = disagreement[leaf.node];
    const double extent = field.blend * query::cellSize(field, deepest[leaf.node]).minCoeff();
    bound.error = roundedUp(double(bound.error) + others.error + rounding);
    bound.slope = roundedUp(double(bound.slope) + others.slope + kSlopes * (others.value + rounding) / extent);
  }
}

}  // namespace

bool isProvenWithin(const CellPolynomial& polynomial, const AllowedError& allowed, double rounding,
                    std::atomic<std::uint64_t>& evaluations) {
  const double ofValues = kRounding * polynomial.domain.diagonal().norm();
  return Proof(polynomial, allowed, rounding + ofValues, evaluations).holds();
}

std::uint64_t findBounds(FieldData& field, const DistanceFunction& distance, const Progress& progress) {
  field.bounds.clear();
  std::vector<CellBound> bounds(field.nodes.size());
  const std::vector<query::OctreeNode> leaves = query::allLeaves(field);
  BoundFinder find(field, distance);
  const double share = field.blend > 0 ? 0.5 : 1;  // part of the whole progress that this loop makes
  for (std::size_t begin = 0; begin < leaves.size(); begin += kLeavesPerStep) {
    report(progress, share * double(begin) / double(leaves.size()));
    const std::span<const query::OctreeNode> step =
        std::span(leaves).subspan(begin, std::min(kLeavesPerStep, leaves.size() - begin));
    tbb::parallel_for(std::size_t{0}, (step.size() + kLeavesAtOnce - 1) / kLeavesAtOnce, [&](std::size_t n) {
      const std::size_t first = n * kLeavesAtOnce;
      find(step.subspan(first, std::min(kLeavesAtOnce, step.size() - first)), bounds);
    });
  }
  field.bounds = std::move(bounds);
  if (field.blend > 0) widenForBlending(field, find, leaves, progress);
  return find.evaluations();
}

}  // namespace hpsdf::detail
