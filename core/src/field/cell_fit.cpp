#include "field/cell_fit.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "hpsdf/error.h"

namespace hpsdf {
namespace {

/// Points an axis for a rule exact to degree multiple·p; at least p+2, so that the children's points also carry p+1.
int pointsPerAxis(int degree, int multiple) { return std::max((multiple * degree + 2) / 2, degree + 2); }

/// Points handed to Φ at once: long enough to amortise a call, short enough to notice a cancellation.
constexpr std::size_t kBatch = 512;

/// The points of a tensor product of n an axis along Morton's curve: neighbours in this order are neighbours in space,
/// which exact distances are fastest with.
std::vector<std::array<std::uint32_t, 3>> mortonOrder(std::uint32_t n) {
  const auto code = [](const std::array<std::uint32_t, 3>& point) {
    std::uint32_t bits = 0;
    for (int bit = 0; bit < 10; ++bit)
      for (int axis = 0; axis < 3; ++axis) bits |= (point[axis] >> bit & 1) << (3 * bit + 2 - axis);
    return bits;
  };
  std::vector<std::array<std::uint32_t, 3>> order;
  for (std::uint32_t a = 0; a < n; ++a)
    for (std::uint32_t b = 0; b < n; ++b)
      for (std::uint32_t c = 0; c < n; ++c) order.push_back({a, b, c});
  std::ranges::sort(order, {}, code);
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

/// The children's samples, put together as one tensor over the parent.
std::vector<double> joined(const std::array<std::vector<double>, 8>& children, int n) {
  std::vector<double> all(std::size_t(8) * n * n * n);
  const int side = 2 * n;
  for (int child = 0; child < 8; ++child) {
    const int x = child & 1, y = (child >> 1) & 1, z = child >> 2;
    const double* in = children[child].data();
    for (int a = 0; a < n; ++a)
      for (int b = 0; b < n; ++b, in += n)
        std::copy_n(in, n, &all[(std::size_t(x * n + a) * side + y * n + b) * side + z * n]);
  }
  return all;
}

double volumeOf(const Box& box) { return (box.max() - box.min()).prod(); }

void checkFinite(std::span<const Vector3> points, std::span<const double> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i])) continue;
    std::ostringstream where;
    where << "the signed distance is not finite at (" << points[i].x() << ", " << points[i].y() << ", " << points[i].z()
          << "); it must be defined in the whole domain";
    throw Error(where.str());
  }
}

}  // namespace

CellFitter::CellFitter(const DistanceFunction& distance, const BuildOptions& options, double diagonal,
                       const Progress& progress)
    : distance_(distance), options_(options), diagonal_(diagonal), progress_(progress) {}

const CellFitter::Rules& CellFitter::rules(int degree) const {
  std::call_once(rulesMade_[degree], [&] {
    const QuadratureRule rule = gaussLegendre(pointsPerAxis(degree, options_.quadrature));
    rules_[degree] =
        std::make_unique<Rules>(Rules{rule, mortonOrder(static_cast<std::uint32_t>(rule.points.size())),
                                      Projection(rule, degree), Projection(splitInHalves(rule), degree + 1)});
  });
  return *rules_[degree];
}

CellFitter::Samples CellFitter::sample(const Box& cell, const Rules& rules) const {
  const auto& at = rules.points.points;
  const std::size_t n = at.size();
  const Vector3 centre = cell.center();
  const Vector3 half = cell.sizes() / 2;
  Samples samples;
  samples.values.resize(n * n * n);
  double clearance = 0;  // no point of the cell is closer to the surface, Φ being 1-Lipschitz
  std::array<Vector3, kBatch> points;
  std::array<double, kBatch> values;
  for (std::size_t first = 0; first < rules.order.size(); first += kBatch) {
    if (progress_.cancelled && progress_.cancelled()) throw Cancelled();
    const auto batch = std::span(rules.order).subspan(first, std::min(kBatch, rules.order.size() - first));
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const auto [a, b, c] = batch[i];
      points[i] = centre + half.cwiseProduct(Vector3(at[a], at[b], at[c]));
    }
    distance_(std::span(points).first(batch.size()), std::span(values).first(batch.size()));
    checkFinite(std::span(points).first(batch.size()), std::span(values).first(batch.size()));
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const auto [a, b, c] = batch[i];
      samples.values[(a * n + b) * n + c] = values[i];
      if (options_.band > 0) {
        const double farthestCorner = ((points[i] - centre).cwiseAbs() + half).norm();
        clearance = std::max(clearance, std::abs(values[i]) - farthestCorner);
      }
    }
  }
  evaluations_ += samples.values.size();
  samples.outsideBand = options_.band > 0 && clearance > options_.band;
  return samples;
}

double CellFitter::shellError(const Fit& fit, double volume) const {
  return nearnessWeight(fit) * topDegreeError(fit.coefficients.data(), fit.degree, volume);
}

double CellFitter::nearnessWeight(const Fit& fit) const {
  // Mean of the cell's own fit: c_000, the others having none (paper, eq. 10).
  const double mean = fit.coefficients[0];
  return std::pow(std::clamp(1 - std::abs(mean) / diagonal_, 0.0, 1.0), options_.nearness);
}

Fit CellFitter::project(const Projection& projection, const Box& cell, std::span<const double> samples,
                        bool outsideBand) const {
  Fit fit;
  fit.degree = projection.degree();
  fit.coefficients = projection(samples);
  if (outsideBand) return fit;
  fit.error = shellError(fit, volumeOf(cell));
  if (options_.trialSamples == TrialSamples::own) return fit;

  // The estimate's blind spot: where Φ is even or odd about the cell's centre, every other shell of coefficients is
  // empty. What the samples say is left over, ∫Φ² − Σc², then stands in; it counts only where it is far above the
  // shell, so that everywhere else the paper's estimate decides.
  const double meanSquare = projection.meanSquare(samples);
  double represented = 0;
  forEachCoefficient(fit.degree, [&](int i, int j, int k, int index) {
    represented += fit.coefficients[index] * fit.coefficients[index] * squaredNorm(i, j, k);
  });
  const double residual = meanSquare - represented;
  const double shell = topDegreeError(fit.coefficients.data(), fit.degree, 1.0);
  if (residual > 1000 * shell && residual > 1e-12 * meanSquare)
    fit.error = nearnessWeight(fit) * residual * volumeOf(cell);
  return fit;
}

Fit CellFitter::fit(const Box& cell, int degree) const {
  const Rules& r = rules(degree);
  const Samples samples = sample(cell, r);
  return project(r.own, cell, samples.values, samples.outsideBand);
}

Fit CellFitter::raisedByOwnSamples(const Box& cell, const Fit& current) const {
  Fit raised = fit(cell, current.degree + 1);
  if (options_.trialSamples == TrialSamples::own) {
    raised.coefficients = appendTopDegree(current.coefficients, raised.coefficients, raised.degree);
    if (raised.error > 0) raised.error = shellError(raised, volumeOf(cell));
  }
  return raised;
}

Trial CellFitter::attempt(const Box& cell, const Fit& current, Refinement allowed) const {
  Trial trial;
  const bool mayRaise = allowed != Refinement::octree;
  if (allowed == Refinement::degree) {
    trial.raised = raisedByOwnSamples(cell, current);
    return trial;
  }
  const Rules& r = rules(current.degree);
  std::array<std::vector<double>, 8> samples;
  trial.children.emplace();
  bool outsideBand = true;
  for (int child = 0; child < 8; ++child) {
    const Box box = childBox(cell, child);
    Samples taken = sample(box, r);
    (*trial.children)[child] = project(r.own, box, taken.values, taken.outsideBand);
    outsideBand = outsideBand && taken.outsideBand;
    samples[child] = std::move(taken.values);
  }
  if (mayRaise) {
    trial.raised = options_.trialSamples == TrialSamples::own
                       ? raisedByOwnSamples(cell, current)
                       : project(r.raised, cell, joined(samples, r.own.pointsPerAxis()), outsideBand);
  }
  return trial;
}

}  // namespace hpsdf
