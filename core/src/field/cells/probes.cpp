#include "field/cells/probes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "field/query/evaluate.h"

namespace hpsdf::detail {
namespace {

constexpr int kAcross = 8;

/// The points at which the error of a cell is measured: a lattice of 8 × 8 × 8 points between opposite corners of
/// the cell.
struct Probes {
  std::vector<std::array<int, 3>> index;  ///< position in the lattice
  std::vector<Vector3> local;             ///< the points in local coordinates
};

/// Returns the lattice of probes, in blocks of eight neighbours. Exact distances are fastest for eight
/// neighbouring points at a time.
const Probes& probes() {
  static const Probes all = [] {
    constexpr int kBlocks = kAcross / 2;  // number of blocks of eight neighbours along an axis
    Probes made;
    for (int block = 0; block < kBlocks * kBlocks * kBlocks; ++block)
      for (int corner = 0; corner < 8; ++corner) {
        const std::array<int, 3> index = {2 * (block % kBlocks) + (corner & 1),
                                          2 * (block / kBlocks % kBlocks) + (corner >> 1 & 1),
                                          2 * (block / kBlocks / kBlocks) + (corner >> 2)};
        made.index.push_back(index);
        made.local.push_back(2.0 / (kAcross - 1) * Vector3(index[0], index[1], index[2]) - Vector3::Ones());
      }
    return made;
  }();
  return all;
}

}  // namespace

const std::vector<Vector3>& probePoints() { return probes().local; }

double worstError(const Fit& fit, std::span<const double> exact, double farthest) {
  constexpr std::array<int, 3> kStride = {1, kAcross, kAcross * kAcross};
  std::array<double, kAcross * kAcross * kAcross> errors;
  const auto place = [&](std::size_t i) {
    const auto& [x, y, z] = probes().index[i];
    return x * kStride[0] + y * kStride[1] + z * kStride[2];
  };
  double worst = 0, step = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const Vector3& local = probes().local[i];
    double& error = errors[place(i)];
    error = query::evaluate(fit.coefficients.data(), fit.degree, {local.x(), local.y(), local.z()}) - exact[i];
    if (std::abs(exact[i]) > farthest) error = std::numeric_limits<double>::quiet_NaN();
    worst = std::fmax(worst, std::abs(error));  // fmax ignores the NaN of probes that do not count
  }
  for (std::size_t i = 0; i < exact.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (probes().index[i][axis] > 0)
        step = std::fmax(step, std::abs(errors[place(i)] - errors[place(i) - kStride[axis]]));
  return worst + step / 2;
}

double probeSpacing(double cellDiagonal) { return cellDiagonal / (2 * (kAcross - 1)); }

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
