#include "field/tolerance/tolerance_fit.h"

#include <limits>
#include <utility>

#include "field/cells/cell_bounds.h"

namespace hpsdf::detail {
namespace {

/// Where a parent's error is so many times the allowed error, not even the error of a smooth distance, which falls by
/// 2^6 in a cell of half the size, would be within the tolerance.
constexpr double kHopeless = 200;

/// Share of the difference between the errors at two neighbouring points that is added to the greater one.
constexpr double kShareOfDifference = 0.25;

/// Returns true if the distance changes faster between two neighbouring points than a signed distance can.
bool hasJump(const CellLattice& lattice, const Box& cell, std::span<const double> distances) {
  constexpr double kRoundingOfSlope = 1.001;
  const Vector3 half = cell.sizes() / 2;
  return std::ranges::any_of(lattice.neighbours(), [&](const auto& pair) {
    const Vector3 step = half.cwiseProduct(lattice.points()[pair.first] - lattice.points()[pair.second]);
    return std::abs(distances[pair.first] - distances[pair.second]) > kRoundingOfSlope * step.norm();
  });
}

/// A place at which a kink of the distance is suspected, and the estimated ratio of the error there to the allowed one.
struct Kink {
  double ratio = 0;
  Vector3 local = Vector3::Zero();
};

/// Appends the kinks that rows of four points suggest. Where the distance has a kink, such as on the planes halfway
/// between two faces, the error has a sharp peak, which all points of the lattices may miss. Beside a kink the distance
/// is nearly linear, which the error is not, so that the place of the kink and the distance there follow from the two
/// slopes beside it. Beyond the faces of the cell there are no points: in an interval that ends at a face, the slope on
/// the outer side of a kink is taken to be the opposite of that on the inner side.
template <typename Points>
void findKinks(const Fit& fit, const AllowedError& allowed, const Points& points,
               std::span<const CellLattice::Row> rows, std::vector<Kink>& kinks) {
  constexpr double kLeast = 0.7;      // lower peaks are not within reach of the greatest allowed ratio
  constexpr double kLeastBend = 0.1;  // change of slope times interval, over the allowed error; it adds a quarter of it
  for (const CellLattice::Row& row : rows) {
    const auto point = [&](int i) -> const auto& { return points[row.points[i]]; };
    const auto width = [&](int i) { return (point(i + 1).local - point(i).local).sum(); };  // along an axis
    const auto slope = [&](int i) { return (point(i + 1).distance - point(i).distance) / width(i); };
    const auto bends = [&](int i, double one, double other) {
      return std::abs(one - other) * width(i) >= kLeastBend * allowed.at(point(i).distance);
    };
    const auto find = [&](int i, double before, double after) {  // in interval i, by the slopes beside the kink
      const double t = (slope(i) - after) / (before - after);
      if (!(t > 0 && t < 1)) return;
      const double distance = point(i).distance + t * width(i) * before;
      const Vector3 local = point(i).local + t * (point(i + 1).local - point(i).local);
      const double ratio = std::abs(fit.valueAt(local) - distance) / allowed.at(distance);
      if (ratio > kLeast) kinks.push_back({ratio, local});
    };
    if (bends(1, slope(0), slope(2))) find(1, slope(0), slope(2));
    if (row.beginsAtFace && bends(0, slope(0), slope(1))) find(0, -slope(1), slope(1));
    if (row.endsAtFace && bends(2, slope(2), slope(1))) find(2, slope(1), -slope(1));
  }
}

Fit polynomial(std::vector<double> coefficients, int degree, const Box& cell) {
  Fit fit;
  fit.degree = degree;
  fit.coefficients = std::move(coefficients);
  fit.isFinal = true;
  fit.error.volume = cell.volume();
  return fit;
}

}  // namespace

ToleranceFitter::ToleranceFitter(const DistanceFunction& distance, const AllowedError& allowed, const Box& domain,
                                 double blend, bool certified, const Progress& progress)
    : distance_(distance),
      allowed_(allowed),
      domain_(domain),
      lattice_(1 + 2 * blend),
      certified_(certified),
      progress_(progress) {
  if (distance.triangleSearch() != nullptr) surface_.emplace(*distance.triangleSearch());
}

std::vector<double> ToleranceFitter::distances(const Box& cell, std::span<const Vector3> local) const {
  evaluations_ += local.size();
  return sampleCells(distance_, {&cell, 1}, local, {}, progress_);
}

/// Returns the greatest error at the lattice, in multiples of the allowed error. A part of the difference between
/// neighbours is added, because errors between them may be greater.
double ToleranceFitter::latticeRatio(std::span<const double> errors, std::span<const double> allowed) const {
  double ratio = 0;
  for (const auto& [a, b] : lattice_.neighbours()) {
    const double error =
        std::max(std::abs(errors[a]), std::abs(errors[b])) + kShareOfDifference * std::abs(errors[a] - errors[b]);
    ratio = std::max(ratio, error / std::min(allowed[a], allowed[b]));
  }
  return ratio;
}

std::vector<ToleranceFitter::CheckedPoint> ToleranceFitter::check(const Fit& fit, const Box& cell,
                                                                  std::span<const Vector3> local) const {
  const std::vector<double> exact = distances(cell, local);
  std::vector<CheckedPoint> points(local.size());
  for (std::size_t i = 0; i < local.size(); ++i)
    points[i] = {local[i], exact[i], std::abs(fit.valueAt(local[i]) - exact[i]) / allowed_.at(exact[i])};
  return points;
}

/// Returns the worst of the points that lie apart from each other.
std::vector<ToleranceFitter::CheckedPoint> ToleranceFitter::topsOf(std::vector<CheckedPoint> points) const {
  constexpr std::size_t kMost = 16;
  constexpr double kLeast = 0.5, kApart = 0.8;  // ratio of the error, and distance in spacings of the lattice
  std::erase_if(points, [](const CheckedPoint& point) { return point.ratio < kLeast; });
  std::ranges::stable_sort(points, std::greater(), &CheckedPoint::ratio);
  std::vector<CheckedPoint> tops;
  for (const CheckedPoint& point : points) {
    if (tops.size() == kMost) break;
    const bool isApart = std::ranges::all_of(
        tops, [&](const CheckedPoint& top) { return (top.local - point.local).norm() >= kApart * lattice_.spacing(); });
    if (isApart) tops.push_back(point);
  }
  return tops;
}

/// Searches for greater errors uphill from several points at once. Returns the greatest ratio, or one that is too
/// great.
double ToleranceFitter::climb(const Fit& fit, const Box& cell, std::vector<CheckedPoint> tops) const {
  constexpr int kRounds = 7;
  constexpr int kDirections = 6;
  std::vector<double> steps(tops.size(), lattice_.spacing() / 2);
  double greatest = 0;
  for (const CheckedPoint& top : tops) greatest = std::max(greatest, top.ratio);
  for (int round = 0; round < kRounds && !tops.empty() && greatest <= kMostRatio; ++round) {
    std::vector<Vector3> around;
    for (std::size_t t = 0; t < tops.size(); ++t)
      for (int direction = 0; direction < kDirections; ++direction) {
        Vector3 point = tops[t].local;
        double& x = point[direction / 2];
        x = std::clamp(x + (direction % 2 == 0 ? steps[t] : -steps[t]), -lattice_.reach(), lattice_.reach());
        around.push_back(point);
      }
    const std::vector<CheckedPoint> checked = check(fit, cell, around);
    for (std::size_t t = 0; t < tops.size(); ++t) {
      const auto own = std::span(checked).subspan(kDirections * t, kDirections);
      const auto best = std::ranges::max_element(own, {}, &CheckedPoint::ratio);
      if (best->ratio > tops[t].ratio)
        tops[t] = *best;
      else
        steps[t] /= 2;
      greatest = std::max(greatest, tops[t].ratio);
    }
  }
  return greatest;
}

/// Adds points of the surface in a cell, where the distance is known. They show narrow slots and thin ribs between the
/// points of the lattice.
void ToleranceFitter::addSurfacePoints(const Fit& fit, const Box& cell, std::vector<CheckedPoint>& points) const {
  if (!surface_) return;
  const Vector3 half = cell.sizes() / 2;
  surface_->forEachIn(cell, [&](const Vector3& point) {
    const Vector3 local = (point - cell.center()).cwiseQuotient(half);
    const double distance = -surface_->offset();
    points.push_back({local, distance, std::abs(fit.valueAt(local) - distance) / allowed_.at(distance)});
  });
}

/// Returns the places at which kinks are suspected, with their errors; of many, those with the greatest estimates.
std::vector<ToleranceFitter::CheckedPoint> ToleranceFitter::checkedKinks(const Fit& fit, const Box& cell,
                                                                         std::span<const CheckedPoint> lattice,
                                                                         std::span<const CheckedPoint> between) const {
  constexpr std::size_t kMost = 96;
  std::vector<Kink> kinks;
  findKinks(fit, allowed_, lattice, lattice_.rows(), kinks);
  findKinks(fit, allowed_, between, lattice_.rowsBetween(), kinks);
  std::ranges::stable_sort(kinks, std::greater(), &Kink::ratio);
  std::vector<Vector3> local(std::min(kMost, kinks.size()));
  for (std::size_t i = 0; i < local.size(); ++i) local[i] = kinks[i].local;
  return local.empty() ? std::vector<CheckedPoint>() : check(fit, cell, local);
}

/// Returns the greatest ratio found in a cell, or one that is too great. `points` are the points of the lattice.
double ToleranceFitter::greatestRatio(const Fit& fit, const Box& cell, std::vector<CheckedPoint> points) const {
  const std::vector<CheckedPoint> between = check(fit, cell, lattice_.pointsBetween());
  const std::vector<CheckedPoint> kinks = checkedKinks(fit, cell, points, between);
  points.insert(points.end(), between.begin(), between.end());
  points.insert(points.end(), kinks.begin(), kinks.end());
  addSurfacePoints(fit, cell, points);
  const double greatest = std::ranges::max_element(points, {}, &CheckedPoint::ratio)->ratio;
  if (greatest > kMostRatio) return greatest;
  return std::max(greatest, climb(fit, cell, topsOf(std::move(points))));
}

ToleranceFit ToleranceFitter::fit(const Box& cell, double ratioAbove) const {
  ToleranceFit result;
  if (ratioAbove > kHopeless) {
    result.ratio = ratioAbove / 2;  // the least by which an error falls if the distance has a kink in the cell
    return result;
  }
  const std::vector<double> exact = distances(cell, lattice_.points());
  result.jumps = hasJump(lattice_, cell, exact);
  std::vector<double> allowed(exact.size());
  std::ranges::transform(exact, allowed.begin(), [&](double distance) { return allowed_.at(distance); });

  std::vector<double> errors(exact.size());
  const auto tried = [&](int degree) {
    Fit fit = polynomial(lattice_.fit(exact, degree), degree, cell);
    errors = lattice_.valuesOf(fit.coefficients, degree);
    for (std::size_t i = 0; i < exact.size(); ++i) errors[i] -= exact[i];
    return fit;
  };
  const auto keepCloser = [&](Fit&& fit, double ratio) {
    if (!result.closest.coefficients.empty() && ratio >= result.ratio) return;
    result.closest = std::move(fit);
    result.ratio = ratio;
  };

  for (int degree = 1; degree <= CellLattice::kMostDegree; ++degree) {
    if (degree == 3) {  // before the degrees in between are tried, the highest one must be within the tolerance
      Fit highest = tried(CellLattice::kMostDegree);
      const double ratio = latticeRatio(errors, allowed);
      if (ratio > kMostRatio) {
        keepCloser(std::move(highest), ratio);
        return result;
      }
    }
    Fit fit = tried(degree);
    double ratio = latticeRatio(errors, allowed);
    if (ratio <= kMostRatio) {
      std::vector<CheckedPoint> points(exact.size());
      for (std::size_t i = 0; i < exact.size(); ++i)
        points[i] = {lattice_.points()[i], exact[i], std::abs(errors[i]) / allowed[i]};
      ratio = greatestRatio(fit, cell, std::move(points));
      if (ratio <= kMostRatio && (!certified_ || isProven(fit, cell))) {
        result.ratio = ratio;
        result.fit = std::move(fit);
        return result;
      }
    }
    if (degree == 2 && ratio > kHopeless / 2) {
      keepCloser(std::move(fit), ratio);
      return result;
    }
    keepCloser(std::move(fit), ratio);
  }
  return result;
}

bool ToleranceFitter::isProven(const Fit& fit, const Box& cell) const {
  double magnitude = 0;  // of the greatest change when all coefficients are rounded to float
  for (const double coefficient : fit.coefficients) magnitude += std::abs(coefficient);
  const double rounding = magnitude * std::numeric_limits<float>::epsilon();
  return isProvenWithin({fit.coefficients, fit.degree, cell, domain_, distance_}, allowed_, rounding, evaluations_);
}

}  // namespace hpsdf::detail
