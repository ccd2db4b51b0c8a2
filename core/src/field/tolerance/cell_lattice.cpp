#include "field/tolerance/cell_lattice.h"

#include <Eigen/QR>

#include "basis/legendre.h"
#include "basis/projection.h"

namespace hpsdf::detail {
namespace {

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

/// The indices of the points of a lattice by their positions along the axes.
class LatticeIndices {
 public:
  explicit LatticeIndices(int across) : across_(across), indices_(std::size_t(across) * across * across) {}

  std::uint32_t& at(int x, int y, int z) { return indices_[(std::size_t(z) * across_ + y) * across_ + x]; }

  std::vector<CellLattice::Line> lines() {
    std::vector<CellLattice::Line> lines;
    for (int a = 0; a < across_; ++a)
      for (int b = 0; b < across_; ++b)
        for (int axis = 0; axis < 3; ++axis) {
          CellLattice::Line line{.axis = axis, .points = {}};
          for (int i = 0; i < across_; ++i)
            line.points.push_back(axis == 0 ? at(i, a, b) : axis == 1 ? at(a, i, b) : at(a, b, i));
          lines.push_back(std::move(line));
        }
    return lines;
  }

 private:
  int across_;
  std::vector<std::uint32_t> indices_;
};

}  // namespace

CellLattice::CellLattice(double reach) : reach_(reach), spacing_(2 * reach / (ProbeLattice::kAcross - 1)) {
  constexpr int kAcross = ProbeLattice::kAcross;
  for (const Vector3& point : probePoints()) points_.push_back(reach * point);
  LatticeIndices indices(kAcross);
  std::uint32_t next = 0;
  forEachInBlocks(kAcross, [&](int x, int y, int z) { indices.at(x, y, z) = next++; });
  lines_ = indices.lines();

  // Along each axis there are the two ends and the middles of all intervals.
  const auto between = [&](int n) { return n == 0 ? 0.0 : n == kAcross ? double(kAcross - 1) : n - 0.5; };
  LatticeIndices indicesBetween(kAcross + 1);
  forEachInBlocks(kAcross + 2, [&](int x, int y, int z) {
    if (std::max({x, y, z}) > kAcross) return;
    indicesBetween.at(x, y, z) = static_cast<std::uint32_t>(between_.size());
    between_.push_back(spacing_ * Vector3(between(x), between(y), between(z)) - Vector3::Constant(reach));
  });
  linesBetween_ = indicesBetween.lines();

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
