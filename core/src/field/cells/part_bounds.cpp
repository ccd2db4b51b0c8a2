#include "field/cells/part_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "basis/coefficient_cube.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {
namespace {

/// Returns a bound of the derivatives of the terms of degree 2 and more, by |L_i| ≤ 1 and |L_i'| ≤ i(i+1)/2.
Vector3 restGradientOf(const PartWithCube& at, int degree) {
  Vector3 sum = Vector3::Zero();
  basis::forEachCoefficient(degree, [&](int i, int j, int k, int) {
    if (i + j + k < 2) return;
    const double c = std::abs(at.cube[basis::cubeIndex(i, j, k, degree)]);
    sum += c / 2 * Vector3(i * (i + 1), j * (j + 1), k * (k + 1));
  });
  return sum.cwiseQuotient(at.part.half);
}

/// Returns a bound of the slope of a part's polynomial.
double slopeOf(const PartWithCube& at, int degree) {
  return (at.part.gradient.cwiseAbs() + restGradientOf(at, degree)).norm();
}

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
  std::array<double, 8> sums, distances;
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
    const double products = (y == z ? part.products[0] : -part.products[0]) +
                            (x == z ? part.products[1] : -part.products[1]) +
                            (x == y ? part.products[2] : -part.products[2]);
    distances[corner] = std::sqrt(squared[0][x] + squared[1][y] + squared[2][z]);
    sums[corner] = sign * (part.value + products) + linear[0][x] + linear[1][y] + linear[2][z] + distances[corner];
  }
  return {*std::ranges::max_element(sums), *std::ranges::max_element(distances)};
}

}  // namespace

Part partOf(const std::vector<double>& cube, int degree, const Vector3& center, const Vector3& half) {
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

/// The two errors: f − Φ, which is bounded by points beyond the part along the gradient, and Φ − f, which is bounded by
/// points on the other side.
enum class Side : std::uint8_t { above, below };

/// A part of the leaf with a bound of one of the two errors.
struct Region {
  PartWithCube at;
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
class ErrorSearch {
 public:
  explicit ErrorSearch(const ErrorQuestion& question) : question_(question) {}

  ErrorBound operator()(const PartWithCube& whole) {
    Region root{.at = whole, .side = Side::above};
    root.reach = 2 * whole.part.half.maxCoeff();
    std::vector<Region> found = quarters(std::move(root));
    for (std::size_t n = 0; n < 4; ++n) {
      found.push_back(found[n]);
      found.back().side = Side::below;
    }
    addApexes(found);
    while (evaluations_ + 2 * kPairs <= question_.mostEvaluations) {
      found.clear();
      for (std::size_t n = 0; n < kPairs; ++n) halve(popGreatest(), found);
      addApexes(found);
    }
    ErrorBound result{.error = std::max(bound(Side::above), bound(Side::below)), .evaluations = evaluations_};
    for (const std::vector<Region>& regions : regions_) {
      double slope = 0;
      for (const Region& region : regions) slope = std::max(slope, slopeOf(region.at, question_.degree));
      result.slope = std::min(result.slope, slope);
    }
    return result;
  }

 private:
  /// Regions that are halved at once: eight points share the search for their nearest triangles.
  static constexpr std::size_t kPairs = 4;
  static constexpr double kStep = 1.6;  ///< factor by which an apex moves out or in

  /// Returns the greatest bound of one error; 0 if no region is left.
  double bound(Side side) const {
    const std::vector<Region>& regions = regions_[side == Side::above ? 0 : 1];
    return regions.empty() ? 0 : regions.front().bound;
  }

  void push(Region&& region) {
    std::vector<Region>& heap = regions_[region.side == Side::above ? 0 : 1];
    heap.push_back(std::move(region));
    std::ranges::push_heap(heap, {}, &Region::bound);
  }

  Region popGreatest() {
    std::vector<Region>& regions = regions_[bound(Side::above) >= bound(Side::below) ? 0 : 1];
    std::ranges::pop_heap(regions, {}, &Region::bound);
    Region region = std::move(regions.back());
    regions.pop_back();
    return region;
  }

  std::vector<Region> quarters(Region&& whole) const {
    std::vector<Region> halves, found;
    halve(std::move(whole), halves);
    for (Region& half : halves) halve(std::move(half), found);
    return found;
  }

  /// Halves a region along the axis along which it extends most across the gradient, and adds the halves to `found`.
  void halve(Region&& region, std::vector<Region>& found) const {
    int axis = 0;
    spreadAcross(region.at.part).maxCoeff(&axis);
    const Vector3 center = region.at.part.center;
    Vector3 half = region.at.part.half;
    half[axis] /= 2;
    found.push_back(region);
    found.push_back(std::move(region));
    for (const bool isUpper : {false, true}) {
      Region& child = found[found.size() - (isUpper ? 1 : 2)];
      restrictToPart(child.at.cube, question_.degree, axis, isUpper ? question_.upper : question_.lower);
      Vector3 at = center;
      at[axis] += isUpper ? half[axis] : -half[axis];
      child.at.part = partOf(child.at.cube, question_.degree, at, half);
      const double gap = spreadAcross(child.at.part).sum() / (2 * child.reach);
      if (child.loss > 2 * gap)
        child.reach = std::min(child.reach / kStep, std::max(child.reach - child.loss / 2, child.reach / 8));
      else if (child.loss < gap / 4)
        child.reach *= kStep;
    }
  }

  /// Returns the squares of the half edges of a part, each in so far as its axis runs across the gradient.
  static Vector3 spreadAcross(const Part& part) {
    const double squared = part.gradient.squaredNorm();
    if (!(squared > 0)) return part.half.cwiseAbs2();
    return part.half.cwiseAbs2().cwiseProduct(Vector3::Ones() - part.gradient.cwiseAbs2() / squared);
  }

  /// Evaluates Φ at an apex of each region, and adds the regions to the heap.
  void addApexes(std::vector<Region>& regions) {
    points_.clear();
    for (Region& region : regions) points_.push_back(apexOf(region));
    values_.resize(points_.size());
    question_.distance(points_, values_);
    evaluations_ += points_.size();
    for (std::size_t n = 0; n < regions.size(); ++n) {
      if (!std::isfinite(values_[n])) throw Error("bounds: the signed distance is not finite within the domain");
      Region& region = regions[n];
      const Part& part = region.at.part;
      // L_2(0) is −1/2.
      const double centre = part.value - (part.squares[0] + part.squares[1] + part.squares[2]) / 2;
      region.loss = std::abs(centre + region.direction() * region.reach - values_[n]);
      boundBy(points_[n], values_[n], region);
      push(std::move(region));
    }
  }

  /// Returns the next apex of a region. Reduces its reach if it would lie outside the domain.
  Vector3 apexOf(Region& region) const {
    const Part& part = region.at.part;
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
    const double bound = coneBound(region.at.part, region.direction(), apex) - region.direction() * distance;
    region.bound = std::min(region.bound, bound);
  }

  const ErrorQuestion& question_;
  std::array<std::vector<Region>, 2> regions_;  ///< by side: a heap with the greatest bound first
  std::vector<Vector3> points_;
  std::vector<double> values_;
  std::uint64_t evaluations_ = 0;
};

}  // namespace

ErrorBound boundError(const PartWithCube& whole, const ErrorQuestion& question) { return ErrorSearch(question)(whole); }

}  // namespace hpsdf::detail
