#include "field/cells/cell_fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "basis/gradient_projection.h"
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
std::unique_ptr<const basis::Projection> makeProjection(int degree, const BuildOptions& options, bool hasGradients) {
  if (options.cubature == CubatureKind::gradients && options.estimator != Estimator::embedded && hasGradients)
    if (auto projection = basis::gradientProjection(degree + 1)) return projection;
  const int order = std::max(options.quadrature * degree, 2 * (degree + 1));
  if (options.cubature != CubatureKind::product)
    if (const auto cubature = basis::compactCubature(order)) return basis::matrixProjection(*cubature, degree + 1);
  return basis::productProjection(basis::gaussLegendre(order / 2 + 1), degree + 1);
}

/// Number of points whose exact distances are searched together. The search is fastest if these points lie close
/// to each other.
constexpr std::size_t kGroup = 16;

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
/// good enough: with very many points, consecutive ones lie close to each other anyway.
std::vector<std::uint32_t> groupedOrder(const std::vector<Vector3>& points) {
  constexpr std::size_t kMost = 8 * 1000;
  if (points.size() > kMost) return {};
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  intoGroups(order, points);
  return order;
}

Vector3 pointIn(const Box& cell, const Vector3& local) {
  return cell.center() + (cell.sizes() / 2).cwiseProduct(local);
}

/// Calls f(points, placeOf) for batches of `total` points, where pointAt(place) is a point and `placeOf(i)` the place
/// of point number i of the batch. The points are taken in the order `order` or, if `order` is empty, as listed.
template <typename PointAt, typename F>
void inBatches(std::size_t total, const PointAt& pointAt, std::span<const std::uint32_t> order,
               const Progress& progress, const F& f) {
  std::array<Vector3, kBatch> points;
  for (std::size_t first = 0; first < total; first += kBatch) {
    progress.throwIfCancelled();
    const std::size_t count = std::min(kBatch, total - first);
    const auto placeOf = [&](std::size_t i) { return order.empty() ? first + i : order[first + i]; };
    for (std::size_t i = 0; i < count; ++i) points[i] = pointAt(placeOf(i));
    f(std::span<const Vector3>(points).first(count), placeOf);
  }
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

/// Returns the check points of a cell in its local coordinates.
std::vector<Vector3> checkLattice() {
  std::vector<Vector3> lattice;
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x) lattice.emplace_back(x, y, z);
  return lattice;
}

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

void requireFinite(const Vector3& point, const Vector3& gradient) {
  if (!gradient.allFinite())
    refuse("the gradient of the signed distance is not finite at (", point.x(), ", ", point.y(), ", ", point.z(), ")");
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
  if (options.estimator != Estimator::checked) return;
  checkLattice_ = checkLattice();
  if (distance.triangleSearch() != nullptr) surface_.emplace(*distance.triangleSearch());
}

const CellFitter::Rules& CellFitter::rules(int degree) const {
  std::call_once(rulesMade_[degree], [&] {
    auto projection = makeProjection(degree, options_, distance_.hasGradients());
    std::vector<Vector3> ofOne = projection->points(), ofEight;
    for (int child = 0; child < 8; ++child) {
      const Box box = childBox(Box(-Vector3::Ones(), Vector3::Ones()), child);
      for (const Vector3& point : projection->points()) ofEight.push_back(box.center() + point / 2);
    }
    for (std::vector<Vector3>* points : {&ofOne, &ofEight})
      points->insert(points->end(), checkLattice_.begin(), checkLattice_.end());
    rules_[degree] = std::make_unique<Rules>(Rules{std::move(projection), groupedOrder(ofOne), groupedOrder(ofEight)});
  });
  return *rules_[degree];
}

std::vector<double> sampleCell(const DistanceFunction& distance, const Box& cell, std::span<const Vector3> local,
                               const Progress& progress) {
  std::vector<double> samples(local.size());
  const auto pointAt = [&](std::size_t place) { return pointIn(cell, local[place]); };
  inBatches(local.size(), pointAt, {}, progress, [&](std::span<const Vector3> points, const auto& placeOf) {
    const std::span<double> values = std::span(samples).subspan(placeOf(0), points.size());
    distance(points, values);
    requireFinite(points, values);
  });
  return samples;
}

std::vector<double> CellFitter::distances(const Box& cell, std::span<const Vector3> local) const {
  evaluations_ += local.size();
  return sampleCell(distance_, cell, local, progress_);
}

CellFitter::Samples CellFitter::sample(const basis::Projection& projection, std::span<const Box> cells,
                                       const Box& whole, std::span<const std::uint32_t> order) const {
  const std::vector<Vector3>& local = projection.points();
  const std::size_t count = cells.size() * local.size(), total = count + checkLattice_.size();
  const auto pointAt = [&](std::size_t place) {
    if (place >= count) return pointIn(whole, checkLattice_[place - count]);
    return pointIn(cells[place / local.size()], local[place % local.size()]);
  };
  Samples samples;
  samples.numbers.resize(count * projection.numbersPerPoint());
  samples.check.local = checkLattice_;
  samples.check.distances.resize(checkLattice_.size());
  std::array<double, kBatch> values;
  std::array<Vector3, kBatch> gradients;
  inBatches(total, pointAt, order, progress_, [&](std::span<const Vector3> points, const auto& placeOf) {
    const std::span<double> found = std::span(values).first(points.size());
    if (projection.takesGradients())
      distance_.withGradients(points, found, std::span(gradients).first(points.size()));
    else
      distance_(points, found);
    requireFinite(points, found);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::size_t place = placeOf(i);
      if (place >= count) {
        samples.check.distances[place - count] = found[i];
        continue;
      }
      double* const to = &samples.numbers[place * projection.numbersPerPoint()];
      *to = found[i];
      if (!projection.takesGradients()) continue;
      requireFinite(points[i], gradients[i]);
      const Vector3 derivatives = gradients[i].cwiseProduct(cells[place / local.size()].sizes() / 2);
      std::copy(derivatives.begin(), derivatives.end(), to + 1);
    }
  });
  samples.evaluations = static_cast<std::uint32_t>(total);
  evaluations_ += total;
  return samples;
}

bool CellFitter::outsideBand(const Box& cell, const basis::Projection& projection,
                             std::span<const double> samples) const {
  if (!(options_.band > 0)) return false;
  double clearance = 0;  // lower bound of the cell's distance from the surface, since Φ is 1-Lipschitz
  for (std::size_t i = 0; i < projection.points().size(); ++i) {
    const Vector3 fromCentre = (cell.sizes() / 2).cwiseProduct(projection.points()[i]);
    const double farthestCorner = (fromCentre.cwiseAbs() + cell.sizes() / 2).norm();
    clearance = std::max(clearance, std::abs(samples[i * projection.numbersPerPoint()]) - farthestCorner);
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

double CellFitter::measuredIfDoubtful(Fit& fit, const Box& cell, double squared) const {
  // A cell of a higher degree was refined because an error had been seen. A distance without triangles may be smooth
  // everywhere.
  constexpr int kHighestDegree = 2;
  if (!surface_ || fit.degree > kHighestDegree) return squared;
  const std::span<const Vector3> points = pointsOfDoubt(squared, cell, nearness_.diagonal);
  if (points.empty()) return squared;
  const std::vector<double> exact = distances(cell, points);
  fit.evaluations += static_cast<std::uint32_t>(points.size());
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
  fit.raisesAtOnce = promisesRaise(projected, degree);
  if (keepsProjections()) fit.cached = std::move(projected);
  return fit;
}

bool CellFitter::promisesRaise(const CachedProjection& projected, int degree) const {
  // By the paper's criterion (eq. 8), a higher degree gains something if it leaves less than an eighth of the error.
  constexpr double kMostLeft = 1.0 / 8;
  constexpr int kDegree = 2;  // the samples of a cell of a higher degree are too few to tell
  if (degree != kDegree || projected.degree != degree + 1 || !rules(degree).projection->takesGradients() ||
      options_.trialSamples == TrialSamples::own)
    return false;
  const std::vector<double> lower = basis::truncated(projected.coefficients, projected.degree, degree);
  return basis::topDegreeError(projected.coefficients.data(), degree + 1, 1.0) <
         kMostLeft * basis::topDegreeError(lower.data(), degree, 1.0);
}

Fit CellFitter::fit(const Box& cell, int degree) const {
  const basis::Projection& projection = *rules(degree).projection;
  const Samples samples = sample(projection, {&cell, 1}, cell, rules(degree).orderOfOne);
  std::vector<double> coefficients = projection(samples.numbers);
  const double meanSquare = projection.meanSquare(samples.numbers, coefficients);
  Fit fit = makeFit({std::move(coefficients), degree + 1, meanSquare}, degree, cell,
                    outsideBand(cell, projection, samples.numbers), samples.check);
  fit.evaluations += samples.evaluations;
  return fit;
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
  if (allowed == Refinement::degree || (allowed == Refinement::either && current.raisesAtOnce)) {
    trial.raised = raisedByOwnSamples(cell, current);
    trial.evaluations = trial.raised->evaluations;
    return trial;
  }
  const int degree = current.degree;
  const basis::Projection& projection = *rules(degree).projection;
  std::array<Box, 8> boxes;
  for (int child = 0; child < 8; ++child) boxes[child] = childBox(cell, child);
  const Samples samples = sample(projection, boxes, cell, rules(degree).orderOfEight);
  std::array<std::vector<double>, 8> raised;  // projections of the children, one degree higher
  trial.children.emplace();
  bool allOutside = true;
  double meanSquare = 0;
  for (int child = 0; child < 8; ++child) {
    const std::size_t count = projection.points().size() * projection.numbersPerPoint();
    const auto own = std::span(samples.numbers).subspan(child * count, count);
    const bool outside = outsideBand(boxes[child], projection, own);
    raised[child] = projection(own);
    const double ownMeanSquare = projection.meanSquare(own, raised[child]);
    (*trial.children)[child] = makeFit({raised[child], degree + 1, ownMeanSquare}, degree, boxes[child], outside,
                                       cornersOfChild(samples.check, child));
    allOutside = allOutside && outside;
    meanSquare += ownMeanSquare / 8;
  }
  if (wantsRaised) {
    trial.raised = options_.trialSamples == TrialSamples::own
                       ? raisedByOwnSamples(cell, current)
                       : makeFit({basis::joined(raised, degree + 1), degree + 1, meanSquare}, degree + 1, cell,
                                 allOutside, samples.check);
  }
  trial.evaluations = samples.evaluations + (trial.raised ? trial.raised->evaluations : 0);
  for (const Fit& child : *trial.children) trial.evaluations += child.evaluations;
  return trial;
}

}  // namespace hpsdf::detail
