#include "hpsdf/continuity.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

#include "field/evaluate.h"
#include "field/face_coupling.h"
#include "field/float_coefficients.h"
#include "field/nearness.h"
#include "field/weak_continuity.h"
#include "hpsdf/error.h"
#include "threads.h"

namespace hpsdf {
namespace {

constexpr std::size_t kChunk = 4096;

/// Σ f(i) for i < count, parallel: in chunks of fixed size, so that rounding does not depend on the number of threads.
template <typename F>
double chunkedSum(std::size_t count, const F& f) {
  std::vector<double> sums((count + kChunk - 1) / kChunk);
  tbb::parallel_for(std::size_t{0}, sums.size(), [&](std::size_t chunk) {
    double sum = 0;
    for (std::size_t i = chunk * kChunk; i < std::min(count, (chunk + 1) * kChunk); ++i) sum += f(i);
    sums[chunk] = sum;
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

void report(const Progress& progress, double fraction) {
  if (progress.cancelled && progress.cancelled()) throw Cancelled();
  if (progress.report) progress.report("closing jumps", std::clamp(fraction, 0.0, 1.0));
}

/// Conjugate gradients on (M + λ)d = −Mx₀, preconditioned by the diagonal; returns d.
class ConjugateGradients {
 public:
  ConjugateGradients(FaceCoupling& coupling, const WeakContinuity& options)
      : coupling_(coupling), options_(options), diagonal_(coupling.diagonal()) {
    for (double& entry : diagonal_) entry += options.weight;
  }

  std::vector<double> solve(const std::vector<double>& x0, const Progress& progress) {
    const std::size_t n = x0.size();
    std::vector<double> change(n, 0.0), residual(n), direction(n), product(n);
    coupling_.apply(0, x0, residual);
    const double size = chunkedSum(n, [&](std::size_t i) { return x0[i] * x0[i]; });
    const double first = chunkedSum(n, [&](std::size_t i) { return residual[i] * residual[i]; });
    if (first <= kRounding * kRounding * size) return change;  // continuous as it is
    double slope = chunkedSum(n, [&](std::size_t i) {
      residual[i] = -residual[i];
      direction[i] = residual[i] / diagonal_[i];
      return residual[i] * direction[i];
    });
    while (figures.iterations < options_.maxIterations) {
      const double length = slope / coupling_.apply(options_.weight, direction, product);
      const double squares = chunkedSum(n, [&](std::size_t i) {
        change[i] += length * direction[i];
        residual[i] -= length * product[i];
        return residual[i] * residual[i];
      });
      ++figures.iterations;
      figures.residual = std::sqrt(squares / first);
      if (figures.residual <= options_.tolerance) {
        figures.change = std::sqrt(chunkedSum(n, [&](std::size_t i) { return change[i] * change[i]; }));
        return change;
      }
      report(progress, std::log(figures.residual) / std::log(options_.tolerance));
      const double before = slope;
      slope = chunkedSum(n, [&](std::size_t i) { return residual[i] * residual[i] / diagonal_[i]; });
      chunkedSum(n, [&](std::size_t i) {
        direction[i] = residual[i] / diagonal_[i] + slope / before * direction[i];
        return 0.0;
      });
    }
    std::ostringstream message;
    message << "weak continuity: " << options_.maxIterations << " iterations leave " << figures.residual
            << " of the residual, more than " << options_.tolerance << "; take a larger weight than "
            << options_.weight << ", or allow more";
    throw Error(message.str());
  }

  WeakContinuityFigures figures;

 private:
  static constexpr double kRounding = 1e-13;

  FaceCoupling& coupling_;
  const WeakContinuity& options_;
  std::vector<double> diagonal_;
};

/// Σ κ_e ‖f − f₀‖² of the cells that count towards ε, in the field's units^5.
double weightedChange(const FieldData& field, std::span<const double> x0, std::span<const double> change) {
  const FieldMetadata& made = field.metadata;
  const double volume = field.domain.sizes().prod(), diagonal = field.domain.diagonal().norm();
  double sum = 0;
  std::size_t at = 0;
  for (const Leaf& leaf : leavesOf(field)) {
    const Vector3 size = cellSize(field, leaf.depth);
    const double mean = x0[at] / std::sqrt(size.prod() / volume);
    const std::size_t end = at + coefficientCount(node::degree(field.nodes[leaf.node]));
    double squares = 0;
    for (; at < end; ++at) squares += change[at] * change[at];
    if (made.band > 0 && std::abs(mean) - size.norm() / 2 > made.band) continue;
    sum += nearnessWeight(made.nearnessKind, made.nearness, mean, diagonal) * squares * volume;
  }
  return sum;
}

}  // namespace

void checkWeakContinuity(const WeakContinuity& options) {
  std::ostringstream message;
  if (!(options.weight > 0) || !std::isfinite(options.weight))
    message << "continuity weight " << options.weight << ": expected a number above 0";
  else if (!(options.tolerance > 0 && options.tolerance < 1))
    message << "tolerance " << options.tolerance << ": expected a number between 0 and 1";
  else if (options.maxIterations < 1)
    message << "maximum of " << options.maxIterations << " iterations: expected 1 or more";
  if (!message.str().empty()) throw Error(message.str());
}

WeakContinuityFigures makeWeaklyContinuous(FieldData& field, const WeakContinuity& options, const Progress& progress) {
  report(progress, 0);
  FaceCoupling coupling(field);
  std::vector<double> x = coupling.toUnknowns(field);
  ConjugateGradients solver(coupling, options);
  const std::vector<double> change = solver.solve(x, progress);
  FieldMetadata& metadata = field.metadata;
  metadata.continuityWeight = options.weight;
  metadata.totalError += weightedChange(field, x, change) / std::pow(metadata.referenceLength / 2, 5);
  field.bounds.clear();
  if (solver.figures.change > 0) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += change[i];
    coupling.fromUnknowns(x, field);
  }
  return solver.figures;
}

WeaklyContinuous weaklyContinuous(const Field& field, const WeakContinuity& options, int threads,
                                  const Progress& progress) {
  checkWeakContinuity(options);
  if (field.metadata().continuityWeight > 0)
    throw Error("the field is weakly continuous already: take it as it was before, or build it anew");
  FieldData data = field.data();
  toDouble(data);
  const WeakContinuityFigures figures =
      withThreads(threads, [&] { return makeWeaklyContinuous(data, options, progress); });
  if (field.singlePrecision()) {
    data.metadata.roundingRms = std::hypot(data.metadata.roundingRms, rmsOfRounding(data));
    toFloat(data);
  }
  return {Field(std::move(data)), figures.iterations, figures.residual, figures.change};
}

}  // namespace hpsdf
