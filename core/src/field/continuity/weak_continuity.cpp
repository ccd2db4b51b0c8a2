#include "field/continuity/weak_continuity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <vector>

#include "field/continuity/face_coupling.h"
#include "field/nearness.h"
#include "field/query/evaluate.h"
#include "hpsdf/error.h"
#include "util/chunks.h"

namespace hpsdf::continuity {
namespace {

constexpr std::size_t kItemsPerTask = 4096;

/// Calls f(first, last, sums) for chunks of fixed size in parallel and adds up the sums chunk by chunk, so that
/// rounding does not depend on the number of threads.
template <std::size_t Sums, typename F>
std::array<double, Sums> sumChunks(std::size_t items, const F& f) {
  std::vector<std::array<double, Sums>> parts(detail::chunksOf(items, kItemsPerTask));
  detail::forEachChunk(items, kItemsPerTask, [&](std::size_t chunk, std::size_t first, std::size_t count) {
    f(first, first + count, parts[chunk]);
  });
  std::array<double, Sums> total{};
  for (const auto& part : parts)
    for (std::size_t s = 0; s < Sums; ++s) total[s] += part[s];
  return total;
}

double squaredNorm(const std::vector<double>& x) {
  return sumChunks<1>(x.size(), [&](std::size_t first, std::size_t last, auto& sums) {
    for (std::size_t i = first; i < last; ++i) sums[0] += x[i] * x[i];
  })[0];
}

void report(const Progress& progress, double fraction) {
  progress.update("closing jumps", std::clamp(fraction, 0.0, 1.0));
}

/// Solves (M + λ)d = −Mx₀ by conjugate gradients with the diagonal as preconditioner.
class ConjugateGradients {
 public:
  ConjugateGradients(FaceCoupling& coupling, const WeakContinuity& options, const std::vector<double>& x0)
      : coupling_(coupling), options_(options), change_(x0.size(), 0.0), residual_(x0.size()) {
    for (const double entry : coupling.diagonal())
      preconditioner_.push_back(static_cast<float>(1 / (entry + options.weight)));
    coupling_.apply(0, x0, residual_);
    for (double& r : residual_) r = -r;
  }

  /// Returns d. Throws `Error` if the iterations do not reach the tolerance.
  std::vector<double> solve(double squaredNormOfX0, const Progress& progress) {
    const double first = squaredNorm(residual_);
    if (first <= kRounding * kRounding * squaredNormOfX0) return std::move(change_);  // The field is continuous.
    direction_.assign(change_.size(), 0.0);
    product_.resize(change_.size());
    double weighted = step(0).weighted, beta = 0;
    while (figures.iterations < options_.maxIterations) {
      updateDirection(beta);
      const ResidualSquares residual = step(weighted / coupling_.apply(options_.weight, direction_, product_));
      beta = residual.weighted / weighted;
      weighted = residual.weighted;
      ++figures.iterations;
      figures.residual = std::sqrt(residual.sum / first);
      if (figures.residual <= options_.tolerance) {
        figures.change = std::sqrt(squaredNorm(change_));
        return std::move(change_);
      }
      report(progress, std::log(figures.residual) / std::log(options_.tolerance));
    }
    std::ostringstream message;
    message << "weak continuity: " << options_.maxIterations << " iterations leave " << figures.residual
            << " of the residual, more than " << options_.tolerance << "; take a larger weight than " << options_.weight
            << ", or allow more";
    throw Error(message.str());
  }

  WeakContinuityFigures figures;

 private:
  /// Residuals below this part of |x₀| are rounding errors.
  static constexpr double kRounding = 1e-13;

  /// Sums over the squares of the residual.
  struct ResidualSquares {
    double sum;
    double weighted;  ///< sum with the preconditioner as weights
  };

  /// Moves the solution along the direction and updates the residual.
  ResidualSquares step(double length) {
    const auto sums = sumChunks<2>(change_.size(), [&](std::size_t first, std::size_t last, auto& part) {
      for (std::size_t i = first; i < last; ++i) {
        change_[i] += length * direction_[i];
        residual_[i] -= length * product_[i];
        const double square = residual_[i] * residual_[i];
        part[0] += square;
        part[1] += square * preconditioner_[i];
      }
    });
    return {sums[0], sums[1]};
  }

  void updateDirection(double beta) {
    sumChunks<0>(change_.size(), [&](std::size_t first, std::size_t last, auto&) {
      for (std::size_t i = first; i < last; ++i)
        direction_[i] = preconditioner_[i] * residual_[i] + beta * direction_[i];
    });
  }

  FaceCoupling& coupling_;
  const WeakContinuity& options_;
  std::vector<float> preconditioner_;  ///< float suffices, as any positive numbers do, and halves the bytes read
  std::vector<double> change_, residual_, direction_, product_;
};

/// Returns Σ κ_e ‖f − f₀‖² over the cells that count towards ε, in the field's units^5.
double weightedChange(const FieldData& field, std::span<const double> x0, std::span<const double> change) {
  const BuildOptions& settings = field.metadata.settings;
  const double volume = field.domain.sizes().prod();
  const detail::Nearness nearness(settings, field.domain);
  double sum = 0;
  std::size_t at = 0;
  for (const query::OctreeNode& leaf : query::allLeaves(field)) {
    const Vector3 size = query::cellSize(field, leaf.depth);
    const double mean = x0[at] / std::sqrt(size.prod() / volume);
    const std::size_t end = at + coefficientCount(node::degree(field.nodes[leaf.node]));
    double squares = 0;
    for (; at < end; ++at) squares += change[at] * change[at];
    if (settings.band > 0 && std::abs(mean) - size.norm() / 2 > settings.band) continue;
    sum += nearness.weight(mean) * squares * volume;
  }
  return sum;
}

}  // namespace

void checkWeakContinuity(const WeakContinuity& options) {
  std::ostringstream message;
  if (!(options.weight > 0 && options.weight <= kMaxContinuityWeight))
    message << "continuity weight " << options.weight << ": expected a number above 0, up to " << kMaxContinuityWeight;
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
  ConjugateGradients solver(coupling, options, x);
  const std::vector<double> change = solver.solve(squaredNorm(x), progress);
  FieldMetadata& metadata = field.metadata;
  metadata.settings.continuityWeight = options.weight;
  metadata.settings.maxError = metadata.measuredError = 0;  // They hold for the polynomials before the change.
  metadata.totalError += weightedChange(field, x, change) / std::pow(metadata.referenceLength / 2, 5);
  field.bounds.clear();
  if (solver.figures.change > 0) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += change[i];
    coupling.fromUnknowns(x, field);
  }
  return solver.figures;
}

}  // namespace hpsdf::continuity
