#include "field/cells/cell_fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "field/nearness.h"
#include "field/query/evaluate.h"
#include "hpsdf/detail/random_points.h"
#include "util/refuse.h"

namespace hpsdf::detail {
namespace {

/// Number of points for which the exact distance is called at once: enough to amortise the call, few enough to
/// notice a cancellation soon.
constexpr std::size_t kBatch = 512;

/// Returns the projection for cells of degree p = `degree`. It projects samples of a cell onto polynomials of degree
/// p+1; the number of samples suffices for this.
std::unique_ptr<const basis::Projection> makeProjection(int degree, const BuildOptions& options) {
  const int order = std::max(options.quadrature * degree, 2 * (degree + 1));
  if (options.cubature == CubatureKind::compact)
    if (const auto cubature = basis::compactCubature(order)) return basis::matrixProjection(*cubature, degree + 1);
  return basis::productProjection(basis::gaussLegendre(order / 2 + 1), degree + 1);
}

/// Number of points whose exact distances are searched together. The search is fastest if these points lie close
/// to each other.
constexpr std::size_t kGroup = 8;

/// Sorts the point indices in `order` into compact groups. Halves the set of points recursively along the longest
/// axis of its box.
void intoGroups(std::span<std::uint32_t> order, const std::vector<Vector3>& points) {
  if (order.size() <= kGroup) return;
  Box box;
  for (const std::uint32_t point : order) box.extend(points[point]);
  int widest = 0;
  box.sizes().maxCoeff(&widest);
  std::ranges::stable_sort(order, {}, [&](std::uint32_t point) { return points[point][widest]; });
  const std::size_t middle = std::max(kGroup, (order.size() / 2 + kGroup / 2) / kGroup * kGroup);
  intoGroups(order.first(middle), points);
  intoGroups(order.subspan(middle), points);
}

/// Returns the indices of the points, sorted into compact groups. Returns an empty list if the given order is
/// good enough: with very many points, eight consecutive ones lie close to each other anyway.
std::vector<std::uint32_t> groupedOrder(const std::vector<Vector3>& points) {
  constexpr std::size_t kMost = 8 * 1000;
  if (points.size() > kMost) return {};
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  intoGroups(order, points);
  return order;
}

/// The box of child number x + 2y + 4z.
Box childBox(const Box& cell, int child) {
  const Vector3 centre = cell.center();
  Vector3 lo = cell.min(), hi = centre;
  for (int axis = 0; axis < 3; ++axis) {
    if ((child >> axis) & 1) {
      lo[axis] = centre[axis];
      hi[axis] = cell.max()[axis];
    }
  }
  return Box(lo, hi);
}

/// Number of check points of a cell along an axis. They include the corners of the cell's eight children.
constexpr int kCheckAxis = 3;

/// Returns the part of the check points of a cell that are corners of one of its children.
CheckPoints cornersOfChild(const CheckPoints& parent, int child) {
  CheckPoints corners;
  if (parent.local.empty()) return corners;
  for (int corner = 0; corner < 8; ++corner) {
    Vector3 local;
    int index = 0;
    for (int axis = 2; axis >= 0; --axis) {
      const int side = corner >> axis & 1;
      index = kCheckAxis * index + (child >> axis & 1) + side;
      local[axis] = 2 * side - 1;
    }
    corners.local.push_back(local);
    corners.distances.push_back(parent.distances[index]);
  }
  return corners;
}

/// Returns this many random points in local coordinates, sorted into compact groups.
std::vector<Vector3> randomPoints(std::size_t count) {
  constexpr std::uint64_t kSeed = 22;
  const Box local(-Vector3::Ones(), Vector3::Ones());
  std::vector<Vector3> points(count), sorted;
  for (std::size_t i = 0; i < count; ++i) points[i] = Random(kSeed, i).inBox(local);
  for (const std::uint32_t i : groupedOrder(points)) sorted.push_back(points[i]);
  return sorted;
}

/// Returns the points, in local coordinates of a cell, at which a mean squared error is measured that is so small for
/// the cell that samples and check points do not prove it: a feature narrower than their spacing may lie between them.
/// A large cell gets more points than a small one, so that narrow features of the surface are found at every depth, and
/// an error near zero more than one that is merely small. Returns no points if the error is believed.
std::span<const Vector3> pointsOfDoubt(double meanSquare, const Box& cell, double diagonal) {
  constexpr double kSmall = 3e-4, kNearZero = 1e-5;  // RMS error over the cell's shortest edge
  static const std::array<std::vector<Vector3>, 2> points = {randomPoints(512), randomPoints(4096)};
  const double rms = std::sqrt(meanSquare) / cell.sizes().minCoeff();
  const double cells = diagonal / std::sqrt(3.0) / cell.sizes().maxCoeff();  // about so many fit side by side
  if (rms > kSmall || cells >= 64) return {};
  return points[rms > kNearZero || cells >= 16 ? 0 : 1];
}

double meanSquareOf(const Fit& fit) {
  double sum = 0;
  basis::forEachCoefficient(fit.degree, [&](int i, int j, int k, int index) {
    sum += fit.coefficients[index] * fit.coefficients[index] * basis::squaredNorm(i, j, k);
  });
  return sum;
}

double squaredErrorAt(const Fit& fit, const Vector3& local, double exact) {
  const double error = fit.valueAt(local) - exact;
  return error * error;
}

double volumeOf(const Box& box) { return (box.max() - box.min()).prod(); }

}  // namespace

double Fit::valueAt(const Vector3& local) const {
  return query::evaluate(coefficients.data(), degree, {local.x(), local.y(), local.z()});
}

void requireFinite(std::span<const Vector3> points, std::span<const double> distances) {
  for (std::size_t i = 0; i < distances.size(); ++i)
    if (!std::isfinite(distances[i]))
      refuse("the signed distance is not finite at (", points[i].x(), ", ", points[i].y(), ", ", points[i].z(),
             "); it must be defined in the whole domain");
}

CellFitter::CellFitter(const DistanceFunction& distance, const BuildOptions& options, const Nearness& nearness,
                       double nearDistance, const Progress& progress)
    : distance_(distance), options_(options), nearness_(nearness), nearDistance_(nearDistance), progress_(progress) {
  if (options.estimator == Estimator::checked && distance.triangleSearch() != nullptr)
    surface_.emplace(*distance.triangleSearch());
}

const CellFitter::Rules& CellFitter::rules(int degree) const {
  std::call_once(rulesMade_[degree], [&] {
    auto projection = makeProjection(degree, options_);
    std::vector<Vector3> childPoints;
    childPoints.reserve(8 * projection->points().size());
    for (int child = 0; child < 8; ++child) {
      const Box box = childBox(Box(-Vector3::Ones(), Vector3::Ones()), child);
      for (const Vector3& point : projection->points()) childPoints.push_back(box.center() + point / 2);
    }
    auto orderOfOne = groupedOrder(projection->points());
    rules_[degree] =
        std::make_unique<Rules>(Rules{std::move(projection), std::move(orderOfOne), groupedOrder(childPoints)});
  });
  return *rules_[degree];
}

std::vector<double> sampleCells(const DistanceFunction& distance, std::span<const Box> cells,
                                std::span<const Vector3> local, std::span<const std::uint32_t> order,
                                const Progress& progress) {
  std::vector<double> samples(cells.size() * local.size());
  std::array<Vector3, kBatch> points;
  std::array<double, kBatch> values;
  for (std::size_t first = 0; first < samples.size(); first += kBatch) {
    progress.throwIfCancelled();
    const std::size_t count = std::min(kBatch, samples.size() - first);
    const auto sampleAt = [&](std::size_t i) { return order.empty() ? first + i : order[first + i]; };
    for (std::size_t i = 0; i < count; ++i) {
      const Box& cell = cells[sampleAt(i) / local.size()];
      points[i] = cell.center() + (cell.sizes() / 2).cwiseProduct(local[sampleAt(i) % local.size()]);
    }
    distance(std::span(points).first(count), std::span(values).first(count));
    requireFinite(std::span(points).first(count), std::span(values).first(count));
    for (std::size_t i = 0; i < count; ++i) samples[sampleAt(i)] = values[i];
  }
  return samples;
}

std::vector<double> CellFitter::sample(std::span<const Box> cells, std::span<const Vector3> local,
                                       std::span<const std::uint32_t> order) const {
  evaluations_ += cells.size() * local.size();
  return sampleCells(distance_, cells, local, order, progress_);
}

bool CellFitter::outsideBand(const Box& cell, const basis::Projection& projection,
                             std::span<const double> samples) const {
  if (!(options_.band > 0)) return false;
  double clearance = 0;  // lower bound of the cell's distance from the surface, since Φ is 1-Lipschitz
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Vector3 fromCentre = (cell.sizes() / 2).cwiseProduct(projection.points()[i]);
    const double farthestCorner = (fromCentre.cwiseAbs() + cell.sizes() / 2).norm();
    clearance = std::max(clearance, std::abs(samples[i]) - farthestCorner);
  }
  return clearance > options_.band;
}

double CellFitter::squaredError(const Fit& fit, double meanSquare) const {
  const double residual = std::max(meanSquare - meanSquareOf(fit), 0.0);
  if (options_.estimator == Estimator::residual) return residual;

  // The paper's estimate is the squared norm of the coefficients of the top degree. If Φ is even or odd about the
  // cell's centre, the coefficients of every other degree vanish, and the estimate may vanish too. The residual, ∫Φ²
  // minus the squared norm of the fit, replaces the estimate where it is far greater. Everywhere else the paper's
  // estimate decides.
  const double shell = basis::topDegreeError(fit.coefficients.data(), fit.degree, 1.0);
  const bool isRounding = residual <= 1e-12 * meanSquare;
  if (options_.estimator == Estimator::checked) return isRounding ? std::min(residual, shell) : residual;
  return residual > 1000 * shell && !isRounding ? residual : shell;
}

/// Sets the error of a fit from `squared`, its mean squared error: the integral divided by the cell's volume.
void CellFitter::rate(Fit& fit, double squared, const Box& cell) const {
  const double mean = fit.coefficients[0];  // the constant coefficient is the mean
  if (fit.outsideBand) return;
  fit.error.volume = volumeOf(cell);
  fit.error.near = std::abs(mean) - cell.sizes().norm() / 2 <= nearDistance_;
  fit.error.squared = squared * fit.error.volume;
  fit.error.weighted = nearness_.weight(mean) * fit.error.squared;
}

CheckPoints CellFitter::checkPoints(const Box& cell) const {
  CheckPoints check;
  if (options_.estimator != Estimator::checked) return check;
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x) check.local.emplace_back(x, y, z);
  check.distances = distances(cell, check.local);
  return check;
}

double CellFitter::checkedError(const Fit& fit, const Box& cell, const CheckPoints& check) const {
  // A kink that all samples of a cell miss cuts off a corner, an edge or a face of it. Its squared error there,
  // averaged over the cell, is about 1/500, 2/240 or 4/120 of the squared error at the corners beyond the kink.
  constexpr double kShare = 1.0 / 200;
  double sum = 0, worst = 0;
  for (std::size_t i = 0; i < check.local.size(); ++i) sum += squaredErrorAt(fit, check.local[i], check.distances[i]);

  // Only the worst of the triangles in the cell counts, because many of them say the same.
  if (surface_) {
    const double exact = -distance_.triangleSearch()->offset();
    surface_->forEachIn(cell, [&](const Vector3& x) {
      const Vector3 local = (x - cell.center()).cwiseQuotient(cell.sizes() / 2);
      worst = std::max(worst, squaredErrorAt(fit, local, exact));
    });
  }
  return kShare * (sum + worst);
}

double CellFitter::measuredIfDoubtful(const Fit& fit, const Box& cell, double squared) const {
  // A cell of a higher degree was refined because an error had been seen. A distance without triangles may be smooth
  // everywhere.
  constexpr int kHighestDegree = 2;
  if (!surface_ || fit.degree > kHighestDegree) return squared;
  const std::span<const Vector3> points = pointsOfDoubt(squared, cell, nearness_.diagonal);
  if (points.empty()) return squared;
  const std::vector<double> exact = distances(cell, points);
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) sum += squaredErrorAt(fit, points[i], exact[i]);
  return std::max(squared, sum / static_cast<double>(points.size()));
}

Fit CellFitter::makeFit(CachedProjection projected, int degree, const Box& cell, bool outsideBand,
                        const CheckPoints& check) const {
  Fit fit;
  fit.degree = degree;
  fit.outsideBand = outsideBand;
  fit.coefficients = basis::truncated(projected.coefficients, projected.degree, degree);
  double squared = options_.trialSamples == TrialSamples::own
                       ? basis::topDegreeError(fit.coefficients.data(), degree, 1.0)
                       : squaredError(fit, projected.meanSquare);
  if (options_.estimator == Estimator::checked) {
    const double residual = squared;
    squared = measuredIfDoubtful(fit, cell, std::max(squared, checkedError(fit, cell, check)));
    // Raise the mean square, so that pruning sees what the checks found.
    if (squared > residual) projected.meanSquare = std::max(projected.meanSquare, meanSquareOf(fit) + squared);
  }
  rate(fit, squared, cell);
  if (keepsProjections()) fit.cached = std::move(projected);
  return fit;
}

Fit CellFitter::fit(const Box& cell, int degree) const {
  const basis::Projection& projection = *rules(degree).projection;
  const std::vector<double> samples = sample({&cell, 1}, projection.points(), rules(degree).orderOfOne);
  return makeFit({projection(samples), degree + 1, projection.meanSquare(samples)}, degree, cell,
                 outsideBand(cell, projection, samples), checkPoints(cell));
}

Fit CellFitter::raisedByOwnSamples(const Box& cell, const Fit& current) const {
  Fit raised = fit(cell, current.degree + 1);
  if (options_.trialSamples == TrialSamples::own) {
    raised.coefficients = basis::appendTopDegree(current.coefficients, raised.coefficients, raised.degree);
    rate(raised, basis::topDegreeError(raised.coefficients.data(), raised.degree, 1.0), cell);
  }
  return raised;
}

Trial CellFitter::attempt(const Box& cell, const Fit& current, Refinement allowed) const {
  Trial trial;
  const bool wantsRaised = allowed != Refinement::octree || keepsProjections();
  if (allowed == Refinement::degree) {
    trial.raised = raisedByOwnSamples(cell, current);
    return trial;
  }
  const int degree = current.degree;
  const basis::Projection& projection = *rules(degree).projection;
  std::array<Box, 8> boxes;
  for (int child = 0; child < 8; ++child) boxes[child] = childBox(cell, child);
  const std::vector<double> samples = sample(boxes, projection.points(), rules(degree).orderOfEight);
  const CheckPoints check = checkPoints(cell);
  std::array<std::vector<double>, 8> raised;  // projections of the children, one degree higher
  trial.children.emplace();
  bool allOutside = true;
  double meanSquare = 0;
  for (int child = 0; child < 8; ++child) {
    const std::size_t count = projection.points().size();
    const auto own = std::span(samples).subspan(child * count, count);
    const bool outside = outsideBand(boxes[child], projection, own);
    const double ownMeanSquare = projection.meanSquare(own);
    raised[child] = projection(own);
    (*trial.children)[child] = makeFit({raised[child], degree + 1, ownMeanSquare}, degree, boxes[child], outside,
                                       cornersOfChild(check, child));
    allOutside = allOutside && outside;
    meanSquare += ownMeanSquare / 8;
  }
  if (wantsRaised) {
    trial.raised =
        options_.trialSamples == TrialSamples::own
            ? raisedByOwnSamples(cell, current)
            : makeFit({basis::joined(raised, degree + 1), degree + 1, meanSquare}, degree + 1, cell, allOutside, check);
  }
  return trial;
}

}  // namespace hpsdf::detail
