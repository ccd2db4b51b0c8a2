#include "field/tolerance/tolerance_fit.h"

#include <array>
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

/// The distance along a line of points, with intervals from each point to the next.
class Profile {
 public:
  template <typename Points>
  Profile(const Points& points, const CellLattice::Line& line) : intervals_(int(line.points.size()) - 1) {
    for (std::size_t i = 0; i < line.points.size(); ++i) {
      positions_[i] = points[line.points[i]].local[line.axis];
      distances_[i] = points[line.points[i]].distance;
    }
    for (int i = 0; i < intervals_; ++i) slopes_[i] = (distances_[i + 1] - distances_[i]) / width(i);
  }

  int intervals() const { return intervals_; }
  double width(int interval) const { return positions_[interval + 1] - positions_[interval]; }
  double slope(int interval) const { return slopes_[interval]; }
  /// Distance at the point at which an interval begins.
  double distance(int interval) const { return distances_[interval]; }

  /// Returns the slope of the interval before another one, or behind it, continued into a quarter of that interval:
  /// linearly by the two nearest intervals, or as a constant.
  double slopeBefore(int interval, bool isConstant) const {
    return continued(interval - 1, interval - 2, positions_[interval] + width(interval) / 4, isConstant);
  }
  double slopeBehind(int interval, bool isConstant) const {
    return continued(interval + 1, interval + 2, positions_[interval + 1] - width(interval) / 4, isConstant);
  }

 private:
  double middle(int interval) const { return (positions_[interval] + positions_[interval + 1]) / 2; }

  double continued(int nearest, int next, double position, bool isConstant) const {
    if (isConstant || next < 0 || next >= intervals_) return slope(nearest);
    const double bend = (slope(nearest) - slope(next)) / (middle(nearest) - middle(next));
    return slope(nearest) + bend * (position - middle(nearest));
  }

  int intervals_;
  std::array<double, CellLattice::kLongestLine> positions_{}, distances_{}, slopes_{};
};

/// The slopes of the distance on both sides of a kink in an interval.
struct SlopesAtKink {
  double before, after;
  double bend;  ///< how much the slope changes in the interval
};

/// Returns the slopes at a kink by the intervals beside its own. Beyond the ends of a line there are no points: the
/// slope on the outer side of the kink is taken to be the opposite of the slope on its inner side.
SlopesAtKink slopesAtKink(const Profile& profile, int interval, bool isConstant) {
  const bool isFirst = interval == 0, isLast = interval == profile.intervals() - 1;
  const double before = isFirst ? 0 : profile.slopeBefore(interval, isConstant);
  const double after = isLast ? 0 : profile.slopeBehind(interval, isConstant);
  if (isFirst) return {-after, after, std::abs(after - profile.slope(interval))};
  if (isLast) return {before, -before, std::abs(before - profile.slope(interval))};
  return {before, after, std::abs(after - before)};
}

/// Seeks kinks of the distance in a cell. At a kink, such as on the planes halfway between two faces, the error has a
/// sharp peak, which all points of the lattices may miss. On both sides of a kink the distance changes smoothly. The
/// place of the kink and the distance there therefore follow from the slopes on its two sides.
class KinkSearch {
 public:
  KinkSearch(const Fit& fit, const AllowedError& allowed) : fit_(fit), allowed_(allowed) {}

  /// Seeks kinks along lines of points. Of all kinks in the same interval of parallel lines, the one with the greatest
  /// error is kept for each way of continuing slopes. Smooth bends also look like kinks, and must not crowd out the
  /// true ones of other intervals.
  template <typename Points>
  void search(const Points& points, std::span<const CellLattice::Line> lines) {
    const std::size_t intervals = lines.front().points.size() - 1, first = greatest_.size();
    greatest_.resize(first + 2 * 3 * intervals);
    for (const CellLattice::Line& line : lines) {
      const Profile profile(points, line);
      for (std::size_t interval = 0; interval < intervals; ++interval)
        for (const bool isConstant : {false, true}) {
          const Vector3& begin = points[line.points[interval]].local;
          const Kink kink = kinkIn(profile, int(interval), isConstant, begin, line.axis);
          Kink& greatest =
              greatest_[first + 2 * (std::size_t(line.axis) * intervals + interval) + (isConstant ? 1 : 0)];
          if (kink.ratio > greatest.ratio) greatest = kink;
        }
    }
  }

  /// Returns the places of all kinks but those where the error is hardly greater than allowed.
  std::vector<Vector3> places() const {
    constexpr double kLeast = 0.7;  // less than 1, because the estimated ratio may be too small
    std::vector<Vector3> places;
    for (const Kink& kink : greatest_)
      if (kink.ratio > kLeast) places.push_back(kink.local);
    return places;
  }

 private:
  /// Returns the kink in an interval, which begins at the point `begin`; with the ratio 0 if there is none.
  Kink kinkIn(const Profile& profile, int interval, bool isConstant, const Vector3& begin, int axis) const {
    constexpr double kLeastBend = 0.1;  // over the allowed error; a change of distance that hardly matters
    const double width = profile.width(interval), slope = profile.slope(interval);
    const auto [before, after, bend] = slopesAtKink(profile, interval, isConstant);
    if (bend * width < kLeastBend * allowed_.at(profile.distance(interval))) return {};
    const double share = (slope - after) / (before - after);  // of the interval that lies before the kink
    if (!(share > 0 && share < 1)) return {};
    const double distance = profile.distance(interval) + share * width * before;
    Vector3 local = begin;
    local[axis] += share * width;
    return {std::abs(fit_.valueAt(local) - distance) / allowed_.at(distance), local};
  }

  const Fit& fit_;
  const AllowedError& allowed_;
  std::vector<Kink> greatest_;
};

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
      quantizationLimits_(allowed, blend),
      domain_(domain),
      lattice_(1 + 2 * blend),
      certified_(certified),
      progress_(progress) {
  if (distance.triangleSearch() != nullptr) surface_.emplace(*distance.triangleSearch());
}

std::vector<double> ToleranceFitter::distances(const Box& cell, std::span<const Vector3> local) const {
  evaluations_ += local.size();
  return sampleCell(distance_, cell, local, progress_);
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

/// Returns the places at which kinks are suspected, with their errors.
std::vector<ToleranceFitter::CheckedPoint> ToleranceFitter::checkedKinks(const Fit& fit, const Box& cell,
                                                                         std::span<const CheckedPoint> lattice,
                                                                         std::span<const CheckedPoint> between) const {
  KinkSearch search(fit, allowed_);
  search.search(lattice, lattice_.lines());
  search.search(between, lattice_.linesBetween());
  const std::vector<Vector3> places = search.places();
  return places.empty() ? std::vector<CheckedPoint>() : check(fit, cell, places);
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
  double magnitude = 0;
  for (const double coefficient : fit.coefficients) magnitude += std::abs(coefficient);
  const double byFloat = magnitude * std::numeric_limits<float>::epsilon();
  const double rounding = std::max(byFloat, quantizationLimits_.greatestChange(fit.coefficients, fit.degree));
  return isProvenWithin({fit.coefficients, fit.degree, cell, domain_, distance_}, allowed_, rounding, evaluations_);
}

}  // namespace hpsdf::detail
