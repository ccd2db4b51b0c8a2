#include "field/build/worst_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "field/query/evaluate.h"

namespace hpsdf {
namespace {

constexpr int kAcross = 8;
constexpr int kBlocks = kAcross / 2;  // of eight neighbours, an axis

/// Block by block, as exact distances are fastest.
std::vector<std::array<int, 3>> makeIndices() {
  std::vector<std::array<int, 3>> indices;
  for (int block = 0; block < kBlocks * kBlocks * kBlocks; ++block)
    for (int corner = 0; corner < 8; ++corner)
      indices.push_back({2 * (block % kBlocks) + (corner & 1), 2 * (block / kBlocks % kBlocks) + (corner >> 1 & 1),
                         2 * (block / kBlocks / kBlocks) + (corner >> 2)});
  return indices;
}

const std::vector<std::array<int, 3>>& indices() {
  static const auto made = makeIndices();
  return made;
}

}  // namespace

std::span<const Vector3> lookedAt() {
  static const std::vector<Vector3> places = [] {
    std::vector<Vector3> made;
    for (const auto& index : indices())
      made.push_back(2.0 / (kAcross - 1) * Vector3(index[0], index[1], index[2]) - Vector3::Ones());
    return made;
  }();
  return places;
}

double worstError(const Fit& fit, std::span<const double> exact, double farthest) {
  std::array<double, kAcross * kAcross * kAcross> errors;
  const auto at = [&](int x, int y, int z) -> double& { return errors[(z * kAcross + y) * kAcross + x]; };
  double worst = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const auto& [x, y, z] = indices()[i];
    const Vector3& local = lookedAt()[i];
    double& error = at(x, y, z);
    error = evaluate(fit.coefficients.data(), fit.degree, {local.x(), local.y(), local.z()}) - exact[i];
    if (std::abs(exact[i]) > farthest) error = std::numeric_limits<double>::quiet_NaN();
    worst = std::fmax(worst, std::abs(error));
  }
  double step = 0;
  for (int z = 0; z < kAcross; ++z)
    for (int y = 0; y < kAcross; ++y)
      for (int x = 0; x < kAcross; ++x) {  // fmax passes over what does not count
        if (x > 0) step = std::fmax(step, std::abs(at(x, y, z) - at(x - 1, y, z)));
        if (y > 0) step = std::fmax(step, std::abs(at(x, y, z) - at(x, y - 1, z)));
        if (z > 0) step = std::fmax(step, std::abs(at(x, y, z) - at(x, y, z - 1)));
      }
  return worst + step / 2;
}

double lookSpacing(double cellDiagonal) { return cellDiagonal / (2 * (kAcross - 1)); }

}  // namespace hpsdf
