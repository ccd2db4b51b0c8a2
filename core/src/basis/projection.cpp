#include "basis/projection.h"

#include <cassert>
#include <cstddef>
#include <utility>

namespace hpsdf::basis {
namespace {

/// Returns the tensor product of three copies of a one-dimensional rule, with z fastest.
Cubature product(const QuadratureRule& axis) {
  Cubature all;
  for (std::size_t a = 0; a < axis.points.size(); ++a)
    for (std::size_t b = 0; b < axis.points.size(); ++b)
      for (std::size_t c = 0; c < axis.points.size(); ++c) {
        all.points.emplace_back(axis.points[a], axis.points[b], axis.points[c]);
        all.weights.push_back(axis.weights[a] * axis.weights[b] * axis.weights[c]);
      }
  return all;
}

/// An L2 projection from samples at the tensor product of a one-dimensional quadrature rule. Contracting one axis after
/// another costs O(n⁴) for n points per axis; a matrix product would cost O(n⁶).
class ProductProjection final : public Projection {
 public:
  ProductProjection(const QuadratureRule& axis, int degree)
      : Projection(product(axis), degree),
        points_(static_cast<int>(axis.points.size())),
        rows_(std::size_t(degree + 1) * points_) {
    std::vector<double> values(degree + 1);
    for (int q = 0; q < points_; ++q) {
      legendreValues(axis.points[q], degree, values.data());
      for (int i = 0; i <= degree; ++i)
        rows_[std::size_t(i) * points_ + q] = (2 * i + 1) / 2.0 * axis.weights[q] * values[i];
    }
  }

  std::vector<double> operator()(std::span<const double> samples) const override {
    assert(samples.size() == std::size_t(points_) * points_ * points_);
    return contractX(contractY(contractZ(samples)));
  }

 private:
  /// Contracts the samples along z: result[a][b][k] = Σ_c rows[k][c] samples[a][b][c].
  std::vector<double> contractZ(std::span<const double> samples) const {
    const int n = points_, count = degree_ + 1;
    std::vector<double> result(std::size_t(n) * n * count);
    for (int line = 0; line < n * n; ++line) {
      const double* in = &samples[std::size_t(line) * n];
      double* out = &result[std::size_t(line) * count];
      for (int k = 0; k < count; ++k) {
        const double* row = &rows_[std::size_t(k) * n];
        double sum = 0;
        for (int c = 0; c < n; ++c) sum += row[c] * in[c];
        out[k] = sum;
      }
    }
    return result;
  }

  /// Contracts along y: result[a][j][k] = Σ_b rows[j][b] alongZ[a][b][k], for j+k ≤ p.
  std::vector<double> contractY(const std::vector<double>& alongZ) const {
    const int n = points_, count = degree_ + 1;
    std::vector<double> result(std::size_t(n) * count * count, 0.0);
    for (int a = 0; a < n; ++a) {
      for (int j = 0; j < count; ++j) {
        double* out = &result[(std::size_t(a) * count + j) * count];
        for (int b = 0; b < n; ++b) {
          const double factor = rows_[std::size_t(j) * n + b];
          const double* in = &alongZ[(std::size_t(a) * n + b) * count];
          for (int k = 0; k < count - j; ++k) out[k] += factor * in[k];
        }
      }
    }
    return result;
  }

  /// Contracts along x: coefficient (i, j, k) = Σ_a rows[i][a] alongY[a][j][k], for i+j+k ≤ p.
  std::vector<double> contractX(const std::vector<double>& alongY) const {
    const int n = points_, count = degree_ + 1;
    std::vector<double> result(coefficientCount(degree_), 0.0);
    double* out = result.data();
    for (int i = 0; i < count; ++i) {
      for (int j = 0; j < count - i; ++j) {
        const int length = count - i - j;
        for (int a = 0; a < n; ++a) {
          const double factor = rows_[std::size_t(i) * n + a];
          const double* in = &alongY[(std::size_t(a) * count + j) * count];
          for (int k = 0; k < length; ++k) out[k] += factor * in[k];
        }
        out += length;
      }
    }
    return result;
  }

  int points_;                ///< number of quadrature points along an axis
  std::vector<double> rows_;  ///< rows_[i][q] = (2i+1)/2 · w_q · L_i(x_q) for the quadrature point x_q with weight w_q
};

/// An L2 projection from samples at the points of any cubature, stored as one matrix.
class MatrixProjection final : public Projection {
 public:
  MatrixProjection(const Cubature& cubature, int degree)
      : Projection(cubature, degree), matrix_(points().size() * coefficientCount(degree)) {
    std::vector<double> x(degree + 1), y(degree + 1), z(degree + 1);
    double* row = matrix_.data();
    for (std::size_t q = 0; q < points().size(); ++q) {
      legendreValues(points()[q].x(), degree, x.data());
      legendreValues(points()[q].y(), degree, y.data());
      legendreValues(points()[q].z(), degree, z.data());
      forEachCoefficient(degree, [&](int i, int j, int k, int) {
        *row++ = cubature.weights[q] / 8 / squaredNorm(i, j, k) * x[i] * y[j] * z[k];
      });
    }
  }

  std::vector<double> operator()(std::span<const double> samples) const override {
    assert(samples.size() == points().size());
    std::vector<double> coefficients(coefficientCount(degree_), 0.0);
    const double* row = matrix_.data();
    for (const double sample : samples)
      for (double& c : coefficients) c += *row++ * sample;
    return coefficients;
  }

 private:
  std::vector<double> matrix_;  ///< factor of each sample in each coefficient: [sample][coefficient]
};

/// Returns the index of the coefficient (i, j, k) in the coefficients of a polynomial of total degree `degree`.
int indexOf(int i, int j, int k, int degree) {
  const int rest = degree - i;
  return coefficientCount(degree) - coefficientCount(rest) +
         ((rest + 1) * (rest + 2) - (rest - j + 1) * (rest - j + 2)) / 2 + k;
}

/// Joins the projections of the two halves of a box into the projection of the whole box. The halves are
/// adjacent along `axis`.
std::vector<double> joinedAlong(int axis, const std::vector<double>& below, const std::vector<double>& above,
                                int degree) {
  static const std::array<detail::LegendreRows, 2> shares = halfShares();
  std::vector<double> whole(below.size(), 0.0);
  forEachCoefficient(degree, [&](int i, int j, int k, int index) {
    std::array<int, 3> at{i, j, k};
    const int top = at[axis];
    for (int a = 0; a <= top; ++a) {
      at[axis] = a;
      const int ofHalf = indexOf(at[0], at[1], at[2], degree);
      whole[index] += shares[0][top][a] * below[ofHalf] + shares[1][top][a] * above[ofHalf];
    }
  });
  return whole;
}

}  // namespace

double Projection::meanSquare(std::span<const double> samples, std::span<const double> /*coefficients*/) const {
  double total = 0;
  for (std::size_t s = 0; s < samples.size(); ++s) total += cubature_.weights[s] * samples[s] * samples[s];
  return total / 8;
}

std::unique_ptr<const Projection> productProjection(const QuadratureRule& axis, int degree) {
  return std::make_unique<ProductProjection>(axis, degree);
}

std::unique_ptr<const Projection> matrixProjection(const Cubature& cubature, int degree) {
  return std::make_unique<MatrixProjection>(cubature, degree);
}

std::vector<double> appendTopDegree(std::span<const double> lower, std::span<const double> raised, int raisedDegree) {
  std::vector<double> result(raised.begin(), raised.end());
  std::size_t next = 0;
  forEachCoefficient(raisedDegree, [&](int i, int j, int k, int index) {
    if (i + j + k < raisedDegree) result[index] = lower[next++];
  });
  assert(next == lower.size());
  return result;
}

std::vector<double> truncated(std::span<const double> coefficients, int degree, int to) {
  std::vector<double> result;
  result.reserve(coefficientCount(to));
  forEachCoefficient(degree, [&](int i, int j, int k, int index) {
    if (i + j + k <= to) result.push_back(coefficients[index]);
  });
  return result;
}

std::array<detail::LegendreRows, 2> halfShares() {
  // On the upper half of the interval, L_i((t+1)/2) = Σ_a r_ia L_a(t). Therefore coefficient a of the half contributes
  // to coefficient i of the whole interval with the factor r_ia ‖L_a‖² / (2 ‖L_i‖²).
  const detail::LegendreRows r = detail::legendreOfPart(0.5, 0.5, kMaxDegree + 1);
  std::array<detail::LegendreRows, 2> shares;
  for (int i = 0; i <= kMaxDegree + 1; ++i)
    for (int a = 0; a <= i; ++a) {
      shares[1][i][a] = r[i][a] * (2 * i + 1) / (2 * a + 1) / 2;
      shares[0][i][a] = (i + a) % 2 == 0 ? shares[1][i][a] : -shares[1][i][a];
    }
  return shares;
}

std::vector<double> joined(const std::array<std::vector<double>, 8>& children, int degree) {
  std::vector<std::vector<double>> parts(children.begin(), children.end());
  for (int axis = 0; axis < 3; ++axis) {  // Join pairs along x, then along y, then along z.
    for (std::size_t pair = 0; pair < parts.size() / 2; ++pair)
      parts[pair] = joinedAlong(axis, parts[2 * pair], parts[2 * pair + 1], degree);
    parts.resize(parts.size() / 2);
  }
  return parts[0];
}

}  // namespace hpsdf::basis
