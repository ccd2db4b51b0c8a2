#include "field/cells/probes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace hpsdf::detail {
namespace {

ProbeLattice makeProbeLattice() {
  constexpr int kAcross = ProbeLattice::kAcross;
  ProbeLattice lattice;
  std::array<std::array<std::array<std::uint32_t, kAcross>, kAcross>, kAcross> indices;
  forEachInBlocks(kAcross, [&](int x, int y, int z) {
    indices[x][y][z] = static_cast<std::uint32_t>(lattice.points.size());
    lattice.points.push_back(2.0 / (kAcross - 1) * Vector3(x, y, z) - Vector3::Ones());
    for (const auto& [i, j, k] : {std::array{x - 1, y, z}, std::array{x, y - 1, z}, std::array{x, y, z - 1}})
      if (i >= 0 && j >= 0 && k >= 0) lattice.neighbours.emplace_back(indices[i][j][k], indices[x][y][z]);
  });
  return lattice;
}

}  // namespace

const ProbeLattice& probeLattice() {
  static const ProbeLattice lattice = makeProbeLattice();
  return lattice;
}

double worstError(const Fit& fit, std::span<const double> exact, double farthest) {
  std::vector<double> errors(exact.size());
  double worst = 0, step = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    errors[i] = fit.valueAt(probePoints()[i]) - exact[i];
    if (std::abs(exact[i]) > farthest) errors[i] = std::numeric_limits<double>::quiet_NaN();
    worst = std::fmax(worst, std::abs(errors[i]));  // fmax ignores the NaN of probes that do not count
  }
  for (const auto& [a, b] : probeLattice().neighbours) step = std::fmax(step, std::abs(errors[a] - errors[b]));
  return worst + step / 2;
}

double probeSpacing(double cellDiagonal) { return cellDiagonal / (2 * (ProbeLattice::kAcross - 1)); }

std::optional<Fit> fitWithin(const CellFitter& fitter, const Box& cell, double tolerance, int mostDegree,
                             const std::function<bool()>& maySample) {
  constexpr int kHighest = 4;
  constexpr double kHopeless = 1e3;  // a few degrees more do not reduce an error by this factor
  std::vector<double> exact;
  for (int degree = 2; degree <= std::min(kHighest, mostDegree); ++degree) {
    Fit fit = fitter.fit(cell, degree);
    const double rms = std::sqrt(fit.error.squared / cell.volume());
    if (rms > kHopeless * tolerance || fit.outsideBand) return std::nullopt;
    if (rms > tolerance / 2) continue;
    if (exact.empty() && !maySample()) return std::nullopt;
    if (exact.empty()) exact = fitter.distances(cell, probePoints());
    if (worstError(fit, exact, std::numeric_limits<double>::infinity()) > tolerance) continue;
    fit.isFinal = true;
    fit.cached = {};
    return fit;
  }
  return std::nullopt;
}

}  // namespace hpsdf::detail
