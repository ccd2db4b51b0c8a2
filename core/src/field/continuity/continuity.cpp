#include "field/continuity/continuity.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "field/continuity/face_coupling.h"
#include "field/nearness.h"
#include "field/precision/round_coefficients.h"
#include "field/query/evaluate.h"
#include "field/query/float_coefficients.h"
#include "field/query/quantized.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "util/chunks.h"
#include "util/refuse.h"

namespace hpsdf {
namespace continuity {
namespace {

constexpr std::size_t kItemsPerTask = 4096;

struct Sum {
  double value = 0;

  void add(const Sum& other) { value += other.value; }
};

double squaredNorm(const std::vector<double>& x) {
  const auto add = [&](Sum& sum, std::size_t first, std::size_t count) {
    for (std::size_t i = first; i < first + count; ++i) sum.value += x[i] * x[i];
  };
  return detail::sumOfChunks<Sum>(x.size(), kItemsPerTask, {}, "", add).value;
}

void report(const Progress& progress, double fraction) {
  progress.update("closing jumps", std::clamp(fraction, 0.0, 1.0));
}

/// Solves (M + λI)d = −Mx₀ − e by conjugate gradients with the matrix's diagonal as preconditioner. x₀ holds the
/// coefficients of a field, and d is their change. The matrix M measures jumps, and the vector e belongs to the leaves
/// that do not change, see `FaceCoupling`. λ is the weight of the change.
class ConjugateGradients {
 public:
  ConjugateGradients(FaceCoupling& coupling, const WeakContinuity& options, const std::vector<double>& x0)
      : coupling_(coupling), options_(options), change_(x0.size(), 0.0), residual_(x0.size()) {
    for (const double entry : coupling.diagonal())
      preconditioner_.push_back(static_cast<float>(1 / (entry + options.weight)));
    coupling_.apply(0, x0, residual_);
    for (double& r : residual_) r = -r;
    for (std::size_t i = 0; i < coupling.fixedPart().size(); ++i) residual_[i] -= coupling.fixedPart()[i];
  }

  /// Returns the solution d. Throws `Error` if the iteration does not reach the tolerance.
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
    detail::refuse("weak continuity: ", options_.maxIterations, " iterations leave ", figures.residual,
                   " of the residual, more than ", options_.tolerance, "; take a larger weight than ", options_.weight,
                   ", or allow more");
  }

  WeakContinuityFigures figures;

 private:
  /// Residuals whose norm is below this fraction of |x₀| are rounding errors.
  static constexpr double kRounding = 1e-13;

  /// The sum of the squared components of the residual, and the same sum with the preconditioner as weights.
  struct ResidualSquares {
    double sum = 0;
    double weighted = 0;  ///< sum with the preconditioner as weights

    void add(const ResidualSquares& other) {
      sum += other.sum;
      weighted += other.weighted;
    }
  };

  /// Moves the solution by `length` along the search direction. Updates the residual, and returns the sums of the
  /// squares of the new residual.
  ResidualSquares step(double length) {
    const auto move = [&](ResidualSquares& squares, std::size_t first, std::size_t count) {
      for (std::size_t i = first; i < first + count; ++i) {
        change_[i] += length * direction_[i];
        residual_[i] -= length * product_[i];
        const double square = residual_[i] * residual_[i];
        squares.sum += square;
        squares.weighted += square * preconditioner_[i];
      }
    };
    return detail::sumOfChunks<ResidualSquares>(change_.size(), kItemsPerTask, {}, "", move);
  }

  void updateDirection(double beta) {
    detail::forEachChunk(change_.size(), kItemsPerTask, [&](std::size_t, std::size_t first, std::size_t count) {
      for (std::size_t i = first; i < first + count; ++i)
        direction_[i] = preconditioner_[i] * residual_[i] + beta * direction_[i];
    });
  }

  FaceCoupling& coupling_;
  const WeakContinuity& options_;
  std::vector<float> preconditioner_;  ///< any positive numbers are valid, and float halves the memory traffic
  std::vector<double> change_, residual_, direction_, product_;
};

/// Returns the weighted squared change Σ_e κ_e ∫(f − f₀)² of a field from f₀ to f. The sum is over all cells e or, for
/// a field with a narrow band, over the cells in the band. The weight κ_e depends on the cell's nearness to the
/// surface. The unit is distance² · volume.
double weightedChange(const FieldData& field, std::span<const double> x0, std::span<const double> change) {
  const BuildOptions& settings = field.metadata.settings;
  const double volume = field.domain.sizes().prod();
  const detail::Nearness nearness = detail::nearnessOf(settings, field.domain);
  double sum = 0;
  std::size_t at = 0;
  for (const query::OctreeNode& leaf : query::allLeaves(field)) {
    if (node::isExact(field.nodes[leaf.node])) continue;
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

/// Removes what is known of a field's errors only as long as the field is not changed: its measurement, and the
/// tolerance within which it was built.
void forgetErrors(FieldMetadata& metadata) {
  metadata.measurement.reset();
  if (metadata.settings.tolerance == 0) return;
  metadata.settings.tolerance = metadata.settings.within = metadata.measuredError = 0;
  metadata.settings.certified = false;
}

/// Throws `Error` if an option is out of range.
void checkWeakContinuity(const WeakContinuity& options) {
  if (!(options.weight > 0 && options.weight <= kMaxContinuityWeight))
    detail::refuse("continuity weight ", options.weight, ": expected a number above 0, up to ", kMaxContinuityWeight);
  if (!(options.tolerance > 0 && options.tolerance < 1))
    detail::refuse("tolerance ", options.tolerance, ": expected a number between 0 and 1");
  if (options.maxIterations < 1)
    detail::refuse("maximum of ", options.maxIterations, " iterations: expected 1 or more");
}

}  // namespace

WeakContinuityFigures makeWeaklyContinuous(FieldData& field, const WeakContinuity& options, const Progress& progress) {
  report(progress, 0);
  FaceCoupling coupling(field);
  std::vector<double> x = coupling.toUnknowns(field);
  ConjugateGradients solver(coupling, options, x);
  const std::vector<double> change = solver.solve(squaredNorm(x), progress);
  FieldMetadata& metadata = field.metadata;
  metadata.settings.continuityWeight = options.weight;
  metadata.settings.maxError = metadata.measuredError = 0;  // both are valid only for the unchanged field
  if (metadata.hasEstimate())
    metadata.totalError += weightedChange(field, x, change) / std::pow(metadata.referenceLength / 2, 5);
  field.bounds.clear();
  if (solver.figures.change > 0) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += change[i];
    coupling.fromUnknowns(x, field);
  }
  return solver.figures;
}

}  // namespace continuity

WeaklyContinuous weaklyContinuous(const Field& field, const WeakContinuity& options, int threads,
                                  const Progress& progress) {
  continuity::checkWeakContinuity(options);
  if (field.metadata().settings.continuityWeight)
    throw Error("the field is weakly continuous already: take it as it was before, or build it anew");
  FieldData data = field.data();
  continuity::forgetErrors(data.metadata);
  query::toDouble(data);
  const continuity::WeakContinuityFigures figures =
      withThreads(threads, [&] { return continuity::makeWeaklyContinuous(data, options, progress); });
  const auto* quantized = std::get_if<QuantizedCoefficients>(&field.data().coefficients);
  std::optional<query::Quantized> again;
  if (quantized != nullptr) {
    std::vector<double> steps = query::stepsOf(*quantized, field.data().nodes);
    for (double& step : steps) step *= detail::kWeaklyContinuousStep;
    again = query::quantized(data, steps);
  }
  if (again) {
    query::take(std::move(*again), data);
    data.metadata.roundingRms = std::hypot(1, detail::kWeaklyContinuousStep) * data.metadata.roundingRms;
  } else if (quantized != nullptr || field.singlePrecision()) {
    data.metadata.roundingRms = std::hypot(data.metadata.roundingRms, query::floatRounding(data).rms);
    query::toFloat(data);
  }
  return {Field(std::move(data)), figures.iterations, figures.residual, figures.change};
}

Field blended(const Field& field, double width) {
  if (!(width >= 0 && width <= kMaxBlend))
    throw Error("blend zones of a width of " + std::to_string(width) + " edges are out of range: give 0 to 0.25");
  FieldData data = field.data();
  data.blend = width;
  continuity::forgetErrors(data.metadata);
  data.bounds.clear();  // The bounds depend on which leaves contribute at a point, and blending changes this.
  return Field(std::move(data));
}

}  // namespace hpsdf
