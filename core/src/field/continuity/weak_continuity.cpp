#include "field/continuity/weak_continuity.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <vector>

#include "field/continuity/face_coupling.h"
#include "field/nearness.h"
#include "field/query/evaluate.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace {

constexpr std::size_t kChunk = 4096;

/// Calls f(first, last, sums) for chunks of fixed size, parallel, and adds up the sums: chunk by chunk, so that
/// rounding does not depend on the number of threads.
template <std::size_t Sums, typename F>
std::array<double, Sums> chunked(std::size_t count, const F& f) {
  std::vector<std::array<double, Sums>> parts((count + kChunk - 1) / kChunk);
  tbb::parallel_for(std::size_t{0}, parts.size(),
                    [&](std::size_t chunk) { f(chunk * kChunk, std::min(count, (chunk + 1) * kChunk), parts[chunk]); });
  std::array<double, Sums> total{};
  for (const auto& part : parts)
    for (std::size_t s = 0; s < Sums; ++s) total[s] += part[s];
  return total;
}

double squaredNorm(const std::vector<double>& x) {
  return chunked<1>(x.size(), [&](std::size_t first, std::size_t last, auto& sums) {
    for (std::size_t i = first; i < last; ++i) sums[0] += x[i] * x[i];
  })[0];
}

void report(const Progress& progress, double fraction) { progress.at("closing jumps", std::clamp(fraction, 0.0, 1.0)); }

/// Conjugate gradients on (M + λ)d = −Mx₀, preconditioned by the diagonal.
class ConjugateGradients {
 public:
  ConjugateGradients(FaceCoupling& coupling, const WeakContinuity& options, const std::vector<double>& x0)
      : coupling_(coupling), options_(options), change_(x0.size(), 0.0), residual_(x0.size()) {
    for (const double entry : coupling.diagonal()) scale_.push_back(static_cast<float>(1 / (entry + options.weight)));
    coupling_.apply(0, x0, residual_);
    for (double& r : residual_) r = -r;
  }

  /// d.
  std::vector<double> solve(double sizeOfX0, const Progress& progress) {
    const double first = squaredNorm(residual_);
    if (first <= kRounding * kRounding * sizeOfX0) return std::move(change_);  // continuous as it is
    direction_.assign(change_.size(), 0.0);
    product_.resize(change_.size());
    double slope = step(0).slope, turn = 0;
    while (figures.iterations < options_.maxIterations) {
      turnDirection(turn);
      const Progressed to = step(slope / coupling_.apply(options_.weight, direction_, product_));
      turn = to.slope / slope;
      slope = to.slope;
      ++figures.iterations;
      figures.residual = std::sqrt(to.squares / first);
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
  static constexpr double kRounding = 1e-13;

  struct Progressed {
    double squares;  ///< of the residual
    double slope;    ///< the same, weighed by the preconditioner
  };

  Progressed step(double length) {
    const auto sums = chunked<2>(change_.size(), [&](std::size_t first, std::size_t last, auto& part) {
      for (std::size_t i = first; i < last; ++i) {
        change_[i] += length * direction_[i];
        residual_[i] -= length * product_[i];
        const double square = residual_[i] * residual_[i];
        part[0] += square;
        part[1] += square * scale_[i];
      }
    });
    return {sums[0], sums[1]};
  }

  void turnDirection(double turn) {
    chunked<0>(change_.size(), [&](std::size_t first, std::size_t last, auto&) {
      for (std::size_t i = first; i < last; ++i) direction_[i] = scale_[i] * residual_[i] + turn * direction_[i];
    });
  }

  FaceCoupling& coupling_;
  const WeakContinuity& options_;
  std::vector<float> scale_;  ///< the preconditioner: any positive one will do, and half the bytes are read
  std::vector<double> change_, residual_, direction_, product_;
};

/// Σ κ_e ‖f − f₀‖² of the cells that count towards ε, in the field's units^5.
double weightedChange(const FieldData& field, std::span<const double> x0, std::span<const double> change) {
  const FieldMetadata& made = field.metadata;
  const double volume = field.domain.sizes().prod();
  const Nearness nearness{made.nearnessKind, made.nearness, field.domain.diagonal().norm()};
  double sum = 0;
  std::size_t at = 0;
  for (const Leaf& leaf : leavesOf(field)) {
    const Vector3 size = cellSize(field, leaf.depth);
    const double mean = x0[at] / std::sqrt(size.prod() / volume);
    const std::size_t end = at + coefficientCount(node::degree(field.nodes[leaf.node]));
    double squares = 0;
    for (; at < end; ++at) squares += change[at] * change[at];
    if (made.band > 0 && std::abs(mean) - size.norm() / 2 > made.band) continue;
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
  metadata.continuityWeight = options.weight;
  metadata.maxError = metadata.measuredError = 0;  // was found of other polynomials
  metadata.totalError += weightedChange(field, x, change) / std::pow(metadata.referenceLength / 2, 5);
  field.bounds.clear();
  if (solver.figures.change > 0) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += change[i];
    coupling.fromUnknowns(x, field);
  }
  return solver.figures;
}

}  // namespace hpsdf
