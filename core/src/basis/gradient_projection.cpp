#include "basis/gradient_projection.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "basis/legendre.h"

namespace hpsdf::basis {
namespace {

/// A point and all its images under the symmetries of the cube.
struct GradientOrbit {
  double x, y, z;
};

// The points below were found by minimising the expected squared error of the fit of degree `degree` − 1 over all
// positions of orbits of these types, from random starts.
constexpr GradientOrbit kDegree3[] = {{0.76416, 0, 0}, {0.72346, 0.72346, 0.72346}};
constexpr GradientOrbit kDegree4[] = {
    {0.90717, 0, 0}, {0.79008, 0.79008, 0.79008}, {0.37254, 0.37254, 0.37254}, {0.81643, 0.81643, 0}};
constexpr GradientOrbit kDegree5[] = {
    {0.92229, 0, 0}, {0.80441, 0.80441, 0.80441}, {0.37251, 0.37251, 0.37251}, {0.82555, 0.82555, 0}};
constexpr GradientOrbit kDegree6[] = {{0.97522, 0, 0},
                                      {0.54351, 0.54351, 0},
                                      {0.87428, 0.87428, 0.87428},
                                      {0.43405, 0.43405, 0.43405},
                                      {0.83443, 0.83443, 0.27244}};

std::span<const GradientOrbit> orbitsFor(int degree) {
  switch (degree) {
    case 3:
      return kDegree3;
    case 4:
      return kDegree4;
    case 5:
      return kDegree5;
    case 6:
      return kDegree6;
    default:
      return {};
  }
}

/// The share of the expected squared error beyond the projection that counts. With it, a target error gives fields of
/// the same measured error as with the quadratures of `CubatureKind::compact`, which see somewhat less than all of it.
constexpr double kShareOfError = 0.8;

/// The number of samples at a point: the value and three derivatives. A sample's number is 0 for the value, else 1 plus
/// the axis of the derivative.
constexpr int kPerPoint = 4;

/// A set of axes, one bit each. As a parity it tells along which axes a function is odd.
using Axes = unsigned;
constexpr Axes kAllAxes = 7;

Axes axisOf(int sample) { return sample == 0 ? 0 : 1U << (sample - 1); }
Axes parityOf(int i, int j, int k) { return (i & 1) | (j & 1) << 1 | (k & 1) << 2; }
bool isOdd(Axes axes) { return std::popcount(axes) % 2 != 0; }

/// Returns the bits of `axes` at the places where `mask` has bits, moved together.
Axes compacted(Axes axes, Axes mask) {
  Axes result = 0;
  int place = 0;
  for (int axis = 0; axis < 3; ++axis)
    if ((mask >> axis & 1) != 0) result |= (axes >> axis & 1) << place++;
  return result;
}

Vector3 mirrored(Vector3 x, Axes axes) {
  for (int axis = 0; axis < 3; ++axis)
    if ((axes >> axis & 1) != 0) x[axis] = -x[axis];
  return x;
}

/// A point without negative coordinates together with its mirror images, which follow each other in the list of points.
struct MirroredPoint {
  Vector3 point;
  Axes axes;  ///< the axes along which it has mirror images: those with a coordinate other than 0
  std::size_t
      first;  ///< index of its first image; the image mirrored along `a` has the index first + compacted(a, axes)

  int images() const { return 1 << std::popcount(axes); }
};

std::vector<MirroredPoint> mirroredPoints(std::span<const GradientOrbit> orbits) {
  std::vector<MirroredPoint> points;
  std::size_t count = 0;
  for (const GradientOrbit& orbit : orbits) {
    std::array<double, 3> x{orbit.x, orbit.y, orbit.z};
    std::ranges::sort(x);
    do {
      const Axes axes = (x[0] > 0 ? 1 : 0) | (x[1] > 0 ? 2 : 0) | (x[2] > 0 ? 4 : 0);
      points.push_back({{x[0], x[1], x[2]}, axes, count});
      count += points.back().images();
    } while (std::ranges::next_permutation(x).found);
  }
  return points;
}

/// Returns the points with all their images. The weights stay empty.
Cubature imagesOf(std::span<const MirroredPoint> points) {
  Cubature all;
  for (const MirroredPoint& point : points) {
    all.points.resize(point.first + point.images());
    for (Axes axes = 0; axes <= kAllAxes; ++axes)
      if ((axes & ~point.axes) == 0)
        all.points[point.first + compacted(axes, point.axes)] = mirrored(point.point, axes);
  }
  return all;
}

/// Returns the covariance |x − y|³ of a function's values, differentiated for samples that are derivatives.
double covariance(const Vector3& x, int sampleAtX, const Vector3& y, int sampleAtY) {
  const Vector3 d = x - y;
  const double r = d.norm();
  if (sampleAtX == 0 && sampleAtY == 0) return r * r * r;
  if (sampleAtY == 0) return 3 * r * d[sampleAtX - 1];
  if (sampleAtX == 0) return -3 * r * d[sampleAtY - 1];
  const double mixed = r > 0 ? d[sampleAtX - 1] * d[sampleAtY - 1] / r : 0;
  return -3 * (mixed + (sampleAtX == sampleAtY ? r : 0));
}

/// The products L_i L_j L_k at a point, or their derivatives along an axis.
class BasisAt {
 public:
  BasisAt(const Vector3& x, int degree) {
    for (int axis = 0; axis < 3; ++axis) {
      values_[axis].resize(degree + 1);
      derivatives_[axis].resize(degree + 1);
      legendreValuesAndDerivatives(x[axis], degree, values_[axis].data(), derivatives_[axis].data());
    }
  }

  double operator()(const std::array<int, 3>& degrees, int sample = 0) const {
    double product = 1;
    for (int axis = 0; axis < 3; ++axis) product *= (sample == axis + 1 ? derivatives_ : values_)[axis][degrees[axis]];
    return product;
  }

 private:
  std::array<std::vector<double>, 3> values_, derivatives_;
};

/// A term L_i L_j L_k of a polynomial.
struct Term {
  std::array<int, 3> degrees;
  int index;  ///< in the polynomial's coefficients

  int degree() const { return degrees[0] + degrees[1] + degrees[2]; }
  double norm() const { return squaredNorm(degrees[0], degrees[1], degrees[2]); }
};

/// The mean over a point's images of the samples of one kind, each multiplied by −1 where the image is mirrored along
/// an odd number of the axes `odd`.
struct MirrorSum {
  const MirroredPoint* point;
  int sample;
  Axes odd;

  /// Returns the place of the sum among the transformed samples.
  std::uint32_t place() const {
    return static_cast<std::uint32_t>(kPerPoint * (point->first + compacted(odd, point->axes)) + sample);
  }
};

/// Returns the covariance of two mirror sums of the same parity. Mirroring all points changes nothing, so that one
/// image of the first point stands for all.
double covariance(const MirrorSum& a, const MirrorSum& b) {
  double sum = 0;
  for (Axes axes = 0; axes <= kAllAxes; ++axes) {
    if ((axes & ~b.point->axes) != 0) continue;
    // A derivative changes its sign where its axis is mirrored; `odd` allows for this.
    const double value = covariance(a.point->point, a.sample, mirrored(b.point->point, axes), b.sample);
    sum += isOdd(axes & b.odd) ? -value : value;
  }
  return sum / b.point->images();
}

/// A tensor product of Gauss points, for the integrals of covariances.
Cubature gaussPoints() {
  constexpr int kAxis = 9;
  const QuadratureRule axis = gaussLegendre(kAxis);
  Cubature all;
  for (int a = 0; a < kAxis; ++a)
    for (int b = 0; b < kAxis; ++b)
      for (int c = 0; c < kAxis; ++c) {
        all.points.emplace_back(axis.points[a], axis.points[b], axis.points[c]);
        all.weights.push_back(axis.weights[a] * axis.weights[b] * axis.weights[c]);
      }
  return all;
}

/// The part of the projection that acts on functions of one parity: even or odd along each axis. Samples of functions
/// of different parities have no covariance, so that the eight parts are independent of each other.
struct ParityPart {
  std::vector<std::uint32_t> sums;  ///< places of the mirror sums of this parity among the transformed samples
  std::vector<int> coefficients;    ///< indices of the coefficients of this parity
  std::vector<double> weights;      ///< [sum][coefficient]: factor of each mean of images in each coefficient
  std::vector<double> unexplained;  ///< [sum][sum]: quadratic form that vanishes for polynomials
  double expectedError = 0;         ///< part of the expected mean squared error, for the covariance |x − y|³
};

class PartMaker {
 public:
  PartMaker(std::span<const MirroredPoint> points, int degree)
      : points_(points), degree_(degree), gauss_(gaussPoints()) {
    for (const Vector3& x : gauss_.points) basisAtGauss_.emplace_back(x, degree);
  }

  ParityPart make(Axes parity) const {
    std::vector<MirrorSum> sums;
    for (const MirroredPoint& point : points_)
      for (int sample = 0; sample < kPerPoint; ++sample)
        if (const Axes odd = parity ^ axisOf(sample); (odd & ~point.axes) == 0) sums.push_back({&point, sample, odd});
    std::vector<Term> terms;  // those that are reproduced come first
    forEachCoefficient(degree_, [&](int i, int j, int k, int index) {
      if (parityOf(i, j, k) == parity) terms.push_back({{i, j, k}, index});
    });
    std::stable_partition(terms.begin(), terms.end(), [&](const Term& term) { return term.degree() < degree_; });
    return solve(sums, terms);
  }

 private:
  using Matrix = Eigen::MatrixXd;

  /// Returns the covariances of mirror sums with the exact coefficients of a term.
  Matrix withCoefficients(const std::vector<MirrorSum>& sums, const std::vector<Term>& terms) const {
    Matrix result = Matrix::Zero(sums.size(), terms.size());
    for (std::size_t s = 0; s < sums.size(); ++s)
      for (std::size_t q = 0; q < gauss_.points.size(); ++q) {
        const double value =
            gauss_.weights[q] / 8 * covariance(sums[s].point->point, sums[s].sample, gauss_.points[q], 0);
        for (std::size_t t = 0; t < terms.size(); ++t)
          result(s, t) += value * basisAtGauss_[q](terms[t].degrees) / terms[t].norm();
      }
    return result;
  }

  /// Solves for the weights with the least expected squared error, with Lagrange multipliers for the terms that must be
  /// reproduced. Eigen's `FullPivLU` takes the same operations on every machine.
  ParityPart solve(const std::vector<MirrorSum>& sums, const std::vector<Term>& terms) const {
    const auto count = static_cast<Eigen::Index>(sums.size());
    const Eigen::Index reproduced =
        std::ranges::count_if(terms, [&](const Term& term) { return term.degree() < degree_; });
    Matrix system = Matrix::Zero(count + reproduced, count + reproduced);
    for (Eigen::Index a = 0; a < count; ++a) {
      const BasisAt basis(sums[a].point->point, degree_);
      for (Eigen::Index b = 0; b < count; ++b) system(a, b) = covariance(sums[a], sums[b]);
      for (Eigen::Index t = 0; t < reproduced; ++t)
        system(a, count + t) = system(count + t, a) = basis(terms[t].degrees, sums[a].sample);
    }
    const Matrix exact = withCoefficients(sums, terms);
    Matrix right = Matrix::Zero(count + reproduced, exact.cols() + count);
    right.topLeftCorner(count, exact.cols()) = exact;
    right.bottomLeftCorner(reproduced, reproduced).setIdentity();
    right.topRightCorner(count, count).setIdentity();
    const Matrix solution = Eigen::FullPivLU<Matrix>(system).solve(right);

    const Matrix weights = solution.topLeftCorner(count, exact.cols());
    ParityPart part;
    for (std::size_t t = 0; t < terms.size(); ++t) {
      const auto w = weights.col(static_cast<Eigen::Index>(t));
      part.expectedError += terms[t].norm() * w.dot(system.topLeftCorner(count, count) * w - 2 * exact.col(t));
      part.coefficients.push_back(terms[t].index);
    }
    for (const MirrorSum& sum : sums) part.sums.push_back(sum.place());
    part.weights = rowByRow(weights);
    part.unexplained = rowByRow(solution.topRightCorner(count, count));
    return part;
  }

  static std::vector<double> rowByRow(const Matrix& matrix) {
    const Matrix transposed = matrix.transpose();  // Eigen stores columns one after another
    return {transposed.data(), transposed.data() + transposed.size()};
  }

  std::span<const MirroredPoint> points_;
  int degree_;
  Cubature gauss_;
  std::vector<BasisAt> basisAtGauss_;
};

class GradientProjection final : public Projection {
 public:
  GradientProjection(std::vector<MirroredPoint> points, int degree)
      : Projection(imagesOf(points), degree), points_(std::move(points)) {
    const PartMaker maker(points_, degree);
    double expectedError = 0;
    for (Axes parity = 0; parity <= kAllAxes; ++parity) {
      parts_.push_back(maker.make(parity));
      expectedError += parts_.back().expectedError;
    }
    // The quadratic form of samples with the covariance v·|x − y|³ is expected to be v times the number of samples
    // minus the number of terms that are reproduced.
    const double freedom = double(kPerPoint * this->points().size()) - coefficientCount(degree - 1);
    for (ParityPart& part : parts_)
      for (double& factor : part.unexplained) factor *= kShareOfError * expectedError / freedom;
  }

  bool takesGradients() const override { return true; }

  std::vector<double> operator()(std::span<const double> samples) const override {
    const std::vector<double> sums = mirrorSums(samples);
    std::vector<double> coefficients(coefficientCount(degree_));
    std::vector<double> own, found;
    for (const ParityPart& part : parts_) {
      gather(sums, part, own);
      multiply(own, part.weights, part.coefficients.size(), found);
      for (std::size_t c = 0; c < found.size(); ++c) coefficients[part.coefficients[c]] = found[c];
    }
    return coefficients;
  }

  double meanSquare(std::span<const double> samples, std::span<const double> coefficients) const override {
    const std::vector<double> sums = mirrorSums(samples);
    std::vector<double> own, left;
    double error = 0;
    for (const ParityPart& part : parts_) {
      gather(sums, part, own);
      multiply(own, part.unexplained, own.size(), left);
      error += std::inner_product(own.begin(), own.end(), left.begin(), 0.0);
    }
    double explained = 0;
    forEachCoefficient(degree_, [&](int i, int j, int k, int index) {
      explained += coefficients[index] * coefficients[index] * squaredNorm(i, j, k);
    });
    return explained + std::max(error, 0.0);
  }

 private:
  /// Returns the mirror sums of all points: for each point a Walsh–Hadamard transform of the samples at its images.
  std::vector<double> mirrorSums(std::span<const double> samples) const {
    assert(samples.size() == kPerPoint * points().size());
    std::vector<double> sums(samples.begin(), samples.end());
    for (const MirroredPoint& point : points_) {
      double* own = &sums[kPerPoint * point.first];
      const int count = kPerPoint * point.images();
      for (int step = kPerPoint; step < count; step *= 2)
        for (int block = 0; block < count; block += 2 * step)
          for (int i = block; i < block + step; ++i) {
            const double a = own[i], b = own[i + step];
            own[i] = (a + b) / 2;
            own[i + step] = (a - b) / 2;
          }
    }
    return sums;
  }

  static void gather(const std::vector<double>& sums, const ParityPart& part, std::vector<double>& own) {
    own.resize(part.sums.size());
    for (std::size_t i = 0; i < own.size(); ++i) own[i] = sums[part.sums[i]];
  }

  /// Multiplies a vector by a matrix with `columns` columns, one row for each element of the vector. All columns are
  /// summed at the same time, so that no addition waits for the one before.
  static void multiply(const std::vector<double>& vector, const std::vector<double>& matrix, std::size_t columns,
                       std::vector<double>& result) {
    result.assign(columns, 0.0);
    const double* factor = matrix.data();
    for (const double element : vector)
      for (double& sum : result) sum += element * *factor++;
  }

  std::vector<MirroredPoint> points_;
  std::vector<ParityPart> parts_;
};

}  // namespace

std::unique_ptr<const Projection> gradientProjection(int degree) {
  const std::span<const GradientOrbit> orbits = orbitsFor(degree);
  if (orbits.empty()) return nullptr;
  return std::make_unique<GradientProjection>(mirroredPoints(orbits), degree);
}

}  // namespace hpsdf::basis
