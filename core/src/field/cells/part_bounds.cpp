#include "field/cells/part_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "basis/coefficient_cube.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {
namespace {

/// The sum of a part's polynomial, up to its terms of degree 2, times `sign` and of |x − y|, at its greatest corner.
struct Corners {
  double greatest, farthest;  ///< the greatest sum, and the greatest distance |x − y|
};

Corners cornersOf(const Part& part, double sign, const Vector3& offset) {
  std::array<std::array<double, 2>, 3> linear, squared;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const double step = side == 0 ? -part.half[axis] : part.half[axis];
      linear[axis][side] = sign * (part.gradient[axis] * step + part.squares[axis]);
      squared[axis][side] = (offset[axis] + step) * (offset[axis] + step);
    }
  using Numbers = Eigen::Array<double, 8, 1>;  // one for each corner
  Numbers sums, distances;
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
    const double products = (y == z ? part.products[0] : -part.products[0]) +
                            (x == z ? part.products[1] : -part.products[1]) +
                            (x == y ? part.products[2] : -part.products[2]);
    distances[corner] = squared[0][x] + squared[1][y] + squared[2][z];
    sums[corner] = sign * (part.value + products) + linear[0][x] + linear[1][y] + linear[2][z];
  }
  distances = distances.sqrt();
  return {(sums + distances).maxCoeff(), distances.maxCoeff()};
}

}  // namespace

Part partOf(std::span<const double> cube, int degree, const Vector3& center, const Vector3& half) {
  const auto coefficient = [&](int i, int j, int k) {
    return i + j + k <= degree ? cube[basis::cubeIndex(i, j, k, degree)] : 0;
  };
  Part part;
  part.center = center;
  part.half = half;
  part.value = coefficient(0, 0, 0);
  part.gradient = Vector3(coefficient(1, 0, 0), coefficient(0, 1, 0), coefficient(0, 0, 1)).cwiseQuotient(half);
  part.squares = {coefficient(2, 0, 0), coefficient(0, 2, 0), coefficient(0, 0, 2)};
  part.products = {coefficient(0, 1, 1), coefficient(1, 0, 1), coefficient(1, 1, 0)};
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; i + j <= degree; ++j)
      for (int k = std::max(0, 3 - i - j); i + j + k <= degree; ++k)
        part.rest += std::abs(cube[basis::cubeIndex(i, j, k, degree)]);
  return part;
}

/// A function that is linear in each coordinate or convex along each axis is greatest at a corner. If the quadratic
/// terms are more concave than |x − y| is convex, the maximum may exceed the corner values by the height of a parabola.
double coneBound(const Part& part, double sign, const Vector3& y) {
  const Vector3 offset = part.center - y;
  auto [bound, farthest] = cornersOf(part, sign, offset);
  const double nearest = (offset.cwiseAbs() - part.half).cwiseMax(0.0).norm();
  for (int axis = 0; axis < 3; ++axis) {
    const double square = part.half[axis] * part.half[axis];
    const double along = nearest > 0 ? std::min(1.0, (std::abs(offset[axis]) + part.half[axis]) / nearest) : 1;
    const double bend = (1 - along * along) / farthest * square;  // least curvature of |x − y| along the axis
    bound += std::max(0.0, -sign * 3 * part.squares[axis] - bend) / 2;
  }
  return bound + part.rest;
}

namespace {

/// The greatest slopes i(i+1)/2 of the Legendre polynomials L_i in [-1, 1].
constexpr auto kSteepest = [] {
  std::array<double, kMaxDegree + 1> slopes{};
  for (int i = 0; i <= kMaxDegree; ++i) slopes[i] = i * (i + 1) / 2;
  return slopes;
}();

/// Returns a bound of the derivatives of the terms of degree 2 and more, by |L_i| ≤ 1 and `kSteepest`.
Vector3 restGradientOf(std::span<const double> cube, int degree, const Vector3& half) {
  Vector3 sum = Vector3::Zero();
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; i + j <= degree; ++j)
      for (int k = std::max(0, 2 - i - j); i + j + k <= degree; ++k)
        sum += std::abs(cube[basis::cubeIndex(i, j, k, degree)]) * Vector3(kSteepest[i], kSteepest[j], kSteepest[k]);
  return sum.cwiseQuotient(half);
}

/// The two errors: f − Φ, which is bounded by points beyond the part along the gradient, and Φ − f, which is bounded by
/// points on the other side.
enum class Side : std::uint8_t { above, below };

/// A part of the leaf with a bound of one of the two errors.
struct Region {
  Part part;
  Side side;
  double bound = std::numeric_limits<double>::infinity();
  double reach = 0;  ///< distance of the next apex from the centre
  double loss = 0;   ///< what Φ at the last apex lacks to the reach

  double direction() const { return side == Side::above ? 1 : -1; }
};

/// Bounds the error by branch and bound. For each of the two errors there is a partition of the box. The regions with
/// the greatest bounds are halved, and each half gets a point of its own at which Φ is evaluated: its apex, from whose
/// value a cone of slope 1 bounds Φ.
///
/// Along the line through the apex and the centre, the bound is tight if Φ grows by the whole distance. This loss is
/// small up to the next surface halfway between two faces. Across the line, the cone departs from Φ by about s²/2r,
/// where s is the half width of the region and r the distance of the apex. So the apex moves out while the loss is
/// small against s²/2r, and in where it is greater; and regions are halved along axes that run across the gradient.
///
/// The search does not evaluate Φ itself. It tells at which points it needs Φ (`points`), and goes on with the values
/// (`take`), so that several searches can be served at once.
class ErrorSearch {
 public:
  ErrorSearch(const BoxPolynomial& whole, const ErrorQuestion& question)
      : question_(question), degree_(whole.degree), cubes_(whole.cube), cubeSize_(whole.cube.size()) {
    const std::size_t most = question.mostEvaluations + kPoints;  // every region but few has an apex of its own
    cubes_.reserve(most * cubeSize_);
    regions_.reserve(most);
    regions_.push_back({.part = whole.part, .side = Side::above, .reach = 2 * whole.part.half.maxCoeff()});
    waiting_ = {0};
    halveAll();
    halveAll();
    for (std::size_t n = 0; n < kPoints / 2; ++n) {
      waiting_.push_back(copyOf(waiting_[n]));
      regions_[waiting_.back()].side = Side::below;
    }
    chooseApexes();
  }

  /// Returns the points at which Φ is needed next. There are none when the search has ended.
  std::span<const Vector3> points() const { return points_; }

  /// Goes on with the values of Φ at `points`.
  void take(std::span<const double> values) {
    for (std::size_t n = 0; n < waiting_.size(); ++n) {
      if (!std::isfinite(values[n])) throw Error("bounds: the signed distance is not finite within the domain");
      boundBy(points_[n], values[n], regions_[waiting_[n]]);
      push(waiting_[n]);
    }
    evaluations_ += waiting_.size();
    waiting_.clear();
    if (evaluations_ + kPoints <= question_.mostEvaluations) {
      for (std::size_t n = 0; n < kPoints / 2; ++n) waiting_.push_back(popGreatest());
      halveAll();
    }
    chooseApexes();
  }

  ErrorBound result() const {
    ErrorBound result{.error = std::max(bound(Side::above), bound(Side::below)), .evaluations = evaluations_};
    for (const std::vector<std::uint32_t>& heap : heaps_) {
      double slope = 0;
      for (const std::uint32_t n : heap) slope = std::max(slope, slopeOf(n));
      result.slope = std::min(result.slope, slope);
    }
    return result;
  }

 private:
  /// Points of each step: the points of four leaves share the search for their nearest triangles.
  static constexpr std::size_t kPoints = 8;
  static constexpr double kStep = 1.6;  ///< factor by which an apex moves out or in

  std::span<double> cubeOf(std::uint32_t region) { return {&cubes_[region * cubeSize_], cubeSize_}; }

  /// Returns a bound of the slope of a region's polynomial.
  double slopeOf(std::uint32_t region) const {
    const Part& part = regions_[region].part;
    const std::span<const double> cube(&cubes_[region * cubeSize_], cubeSize_);
    return (part.gradient.cwiseAbs() + restGradientOf(cube, degree_, part.half)).norm();
  }

  /// Returns the heap of the regions with a bound of this error, the greatest bound first.
  std::vector<std::uint32_t>& heapOf(Side side) { return heaps_[side == Side::above ? 0 : 1]; }

  /// Returns the greatest bound of one error; 0 if no region is left.
  double bound(Side side) const {
    const std::vector<std::uint32_t>& heap = heaps_[side == Side::above ? 0 : 1];
    return heap.empty() ? 0 : regions_[heap.front()].bound;
  }

  void push(std::uint32_t region) {
    std::vector<std::uint32_t>& heap = heapOf(regions_[region].side);
    heap.push_back(region);
    std::ranges::push_heap(heap, {}, [&](std::uint32_t n) { return regions_[n].bound; });
  }

  std::uint32_t popGreatest() {
    std::vector<std::uint32_t>& heap = heapOf(bound(Side::above) >= bound(Side::below) ? Side::above : Side::below);
    std::ranges::pop_heap(heap, {}, [&](std::uint32_t n) { return regions_[n].bound; });
    const std::uint32_t region = heap.back();
    heap.pop_back();
    return region;
  }

  std::uint32_t copyOf(std::uint32_t region) {
    const auto copy = static_cast<std::uint32_t>(regions_.size());
    regions_.push_back(Region(regions_[region]));
    cubes_.resize(cubes_.size() + cubeSize_);
    std::ranges::copy(cubeOf(region), cubeOf(copy).begin());
    return copy;
  }

  /// Halves the waiting regions. Each makes place for its two halves.
  void halveAll() {
    std::vector<std::uint32_t> halves;
    for (const std::uint32_t region : waiting_) {
      halves.push_back(region);
      halves.push_back(halve(region));
    }
    waiting_ = std::move(halves);
  }

  /// Halves a region along the axis along which it extends most across the gradient. The region becomes its lower half;
  /// the function returns the upper half.
  std::uint32_t halve(std::uint32_t region) {
    const std::uint32_t other = copyOf(region);
    const Part whole = regions_[region].part;
    int axis = 0;
    spreadAcross(whole).maxCoeff(&axis);
    for (const bool isUpper : {false, true}) {
      const std::uint32_t half = isUpper ? other : region;
      restrictToPart(cubeOf(half), degree_, axis, isUpper ? question_.upper : question_.lower);
      Vector3 size = whole.half, center = whole.center;
      size[axis] /= 2;
      center[axis] += isUpper ? size[axis] : -size[axis];
      regions_[half].part = partOf(cubeOf(half), degree_, center, size);
      adaptReach(regions_[half]);
    }
    return other;
  }

  static void adaptReach(Region& region) {
    const double gap = spreadAcross(region.part).sum() / (2 * region.reach);
    if (region.loss > 2 * gap)
      region.reach = std::min(region.reach / kStep, std::max(region.reach - region.loss / 2, region.reach / 8));
    else if (region.loss < gap / 4)
      region.reach *= kStep;
  }

  /// Returns the squares of the half edges of a part, each in so far as its axis runs across the gradient.
  static Vector3 spreadAcross(const Part& part) {
    const double squared = part.gradient.squaredNorm();
    if (!(squared > 0)) return part.half.cwiseAbs2();
    return part.half.cwiseAbs2().cwiseProduct(Vector3::Ones() - part.gradient.cwiseAbs2() / squared);
  }

  void chooseApexes() {
    points_.clear();
    for (const std::uint32_t region : waiting_) points_.push_back(apexOf(regions_[region]));
  }

  /// Returns the next apex of a region. Reduces its reach if it would lie outside the domain.
  Vector3 apexOf(Region& region) const {
    const Part& part = region.part;
    const double steepness = part.gradient.norm();
    if (!(steepness > 0)) region.reach = 0;
    const Vector3 unit =
        steepness > 0 ? Vector3(region.direction() / steepness * part.gradient) : Vector3(Vector3::Zero());
    for (int axis = 0; axis < 3; ++axis) {
      const double wall = unit[axis] > 0 ? question_.domain.max()[axis] : question_.domain.min()[axis];
      if (unit[axis] != 0) region.reach = std::min(region.reach, std::abs((wall - part.center[axis]) / unit[axis]));
    }
    const Vector3 point = part.center + region.reach * unit;
    return point.cwiseMax(question_.domain.min()).cwiseMin(question_.domain.max());
  }

  /// Reduces the bound of a region to what Φ at an apex y proves: Φ(x) lies between Φ(y) − |x − y| and Φ(y) + |x − y|.
  static void boundBy(const Vector3& apex, double distance, Region& region) {
    const Part& part = region.part;
    // L_2(0) is −1/2.
    const double centre = part.value - (part.squares[0] + part.squares[1] + part.squares[2]) / 2;
    region.loss = std::abs(centre + region.direction() * region.reach - distance);
    const double bound = coneBound(part, region.direction(), apex) - region.direction() * distance;
    region.bound = std::min(region.bound, bound);
  }

  const ErrorQuestion& question_;
  int degree_;
  std::vector<double> cubes_;  ///< the regions' coefficients as for `partOf`, one region after the other
  std::size_t cubeSize_;
  std::vector<Region> regions_;
  std::array<std::vector<std::uint32_t>, 2> heaps_;  ///< by side: see `heapOf`
  std::vector<std::uint32_t> waiting_;               ///< regions that wait for Φ at their apexes, which are `points_`
  std::vector<Vector3> points_;
  std::uint64_t evaluations_ = 0;
};

}  // namespace

std::vector<ErrorBound> boundErrors(std::span<const BoxPolynomial> leaves, const ErrorQuestion& question) {
  std::vector<ErrorSearch> searches;
  searches.reserve(leaves.size());
  for (const BoxPolynomial& leaf : leaves) searches.emplace_back(leaf, question);
  std::vector<Vector3> points;
  std::vector<double> values;
  while (true) {
    points.clear();
    for (const ErrorSearch& search : searches)
      points.insert(points.end(), search.points().begin(), search.points().end());
    if (points.empty()) break;
    values.resize(points.size());
    question.distance(points, values);
    std::span<const double> rest(values);
    for (ErrorSearch& search : searches) {
      const std::size_t count = search.points().size();
      search.take(rest.first(count));
      rest = rest.subspan(count);
    }
  }
  std::vector<ErrorBound> bounds;
  bounds.reserve(searches.size());
  for (const ErrorSearch& search : searches) bounds.push_back(search.result());
  return bounds;
}

}  // namespace hpsdf::detail
