#include "field/cells/max_error_probe.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "field/query/evaluate.h"

namespace hpsdf::detail {
namespace {

constexpr int kAcross = 8;
constexpr int kBlocks = kAcross / 2;  // number of blocks of eight neighbours along an axis

/// The lattice block by block: exact distances are fastest for eight neighbouring points.
std::vector<std::array<int, 3>> makeIndices() {
  std::vector<std::array<int, 3>> made;
  for (int block = 0; block < kBlocks * kBlocks * kBlocks; ++block)
    for (int corner = 0; corner < 8; ++corner)
      made.push_back({2 * (block % kBlocks) + (corner & 1), 2 * (block / kBlocks % kBlocks) + (corner >> 1 & 1),
                      2 * (block / kBlocks / kBlocks) + (corner >> 2)});
  return made;
}

const std::vector<std::array<int, 3>>& indices() {
  static const auto made = makeIndices();
  return made;
}

}  // namespace

std::span<const Vector3> maxErrorProbes() {
  static const std::vector<Vector3> probes = [] {
    std::vector<Vector3> made;
    for (const auto& index : indices())
      made.push_back(2.0 / (kAcross - 1) * Vector3(index[0], index[1], index[2]) - Vector3::Ones());
    return made;
  }();
  return probes;
}

double worstError(const Fit& fit, std::span<const double> exact, double farthest) {
  std::array<double, kAcross * kAcross * kAcross> errors;
  const auto at = [&](int x, int y, int z) -> double& { return errors[(z * kAcross + y) * kAcross + x]; };
  double worst = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const auto& [x, y, z] = indices()[i];
    const Vector3& local = maxErrorProbes()[i];
    double& error = at(x, y, z);
    error = query::evaluate(fit.coefficients.data(), fit.degree, {local.x(), local.y(), local.z()}) - exact[i];
    if (std::abs(exact[i]) > farthest) error = std::numeric_limits<double>::quiet_NaN();
    worst = std::fmax(worst, std::abs(error));
  }
  double step = 0;
  for (int z = 0; z < kAcross; ++z)
    for (int y = 0; y < kAcross; ++y)
      for (int x = 0; x < kAcross; ++x) {  // fmax ignores the NaN of probes that do not count
        if (x > 0) step = std::fmax(step, std::abs(at(x, y, z) - at(x - 1, y, z)));
        if (y > 0) step = std::fmax(step, std::abs(at(x, y, z) - at(x, y - 1, z)));
        if (z > 0) step = std::fmax(step, std::abs(at(x, y, z) - at(x, y, z - 1)));
      }
  return worst + step / 2;
}

double probeSpacing(double cellDiagonal) { return cellDiagonal / (2 * (kAcross - 1)); }

}  // namespace hpsdf::detail
