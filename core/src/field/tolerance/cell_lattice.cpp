#include "field/tolerance/cell_lattice.h"

#include <Eigen/QR>

#include "basis/legendre.h"
#include "basis/projection.h"

namespace hpsdf::detail {
namespace {

/// Calls visit(x, y, z) for all positions in a lattice with `across` points along each axis, in blocks of eight
/// neighbours. `across` is even.
template <typename F>
void forEachInBlocks(int across, const F& visit) {
  for (int z = 0; z < across; z += 2)
    for (int y = 0; y < across; y += 2)
      for (int x = 0; x < across; x += 2)
        for (int corner = 0; corner < 8; ++corner) visit(x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2));
}

Eigen::MatrixXd valuesAt(std::span<const Vector3> points, int degree) {
  Eigen::MatrixXd values(points.size(), coefficientCount(degree));
  std::array<double, CellLattice::kMostDegree + 1> x, y, z;
  for (std::size_t row = 0; row < points.size(); ++row) {
    basis::legendreValues(points[row].x(), degree, x.data());
    basis::legendreValues(points[row].y(), degree, y.data());
    basis::legendreValues(points[row].z(), degree, z.data());
    basis::forEachCoefficient(
        degree, [&](int i, int j, int k, int column) { values(Eigen::Index(row), column) = x[i] * y[j] * z[k]; });
  }
  return values;
}

std::vector<double> product(const Eigen::MatrixXd& matrix, std::span<const double> vector) {
  std::vector<double> result(std::size_t(matrix.rows()));
  Eigen::Map<Eigen::VectorXd>(result.data(), matrix.rows()).noalias() =
      matrix * Eigen::Map<const Eigen::VectorXd>(vector.data(), matrix.cols());
  return result;
}

}  // namespace

CellLattice::CellLattice(double reach) : reach_(reach), spacing_(2 * reach / (kAcross - 1)) {
  std::array<std::array<std::array<std::uint32_t, kAcross>, kAcross>, kAcross> indices;
  forEachInBlocks(kAcross, [&](int x, int y, int z) {
    indices[x][y][z] = static_cast<std::uint32_t>(points_.size());
    points_.push_back(spacing_ * Vector3(x, y, z) - Vector3::Constant(reach));
    for (const auto& [i, j, k] : {std::array{x - 1, y, z}, std::array{x, y - 1, z}, std::array{x, y, z - 1}})
      if (i >= 0 && j >= 0 && k >= 0) neighbours_.emplace_back(indices[i][j][k], points_.size() - 1);
  });

  // Along each axis there are the two ends and the middles of all intervals.
  const auto between = [&](int n) { return n == 0 ? 0.0 : n == kAcross ? double(kAcross - 1) : n - 0.5; };
  forEachInBlocks(kAcross + 2, [&](int x, int y, int z) {
    if (std::max({x, y, z}) <= kAcross)
      between_.push_back(spacing_ * Vector3(between(x), between(y), between(z)) - Vector3::Constant(reach));
  });

  for (int degree = 1; degree <= kMostDegree; ++degree) {
    Matrices& matrices = matrices_[degree];
    matrices.values = valuesAt(points_, degree);
    const auto rows = matrices.values.rows();
    matrices.fit = matrices.values.householderQr().solve(Eigen::MatrixXd::Identity(rows, rows));
  }
}

std::vector<double> CellLattice::fit(std::span<const double> samples, int degree) const {
  return product(matrices_[degree].fit, samples);
}

std::vector<double> CellLattice::valuesOf(std::span<const double> coefficients, int degree) const {
  return product(matrices_[degree].values, coefficients);
}

}  // namespace hpsdf::detail
