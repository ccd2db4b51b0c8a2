#include <array>
#include <cstddef>

#include "basis/legendre.h"
#include "field/query/evaluate.h"
#include "field/query/quantized.h"
#include "hpsdf/detail/field_data.h"

namespace hpsdf::query {
namespace {

/// Legendre polynomials at one coordinate, with their first and second derivatives.
struct LegendreDerivatives {
  std::array<double, kMaxDegree + 1> value, first, second;

  LegendreDerivatives(double t, int degree) {
    basis::legendreValuesAndDerivatives(t, degree, value.data(), first.data());
    basis::legendreSecondDerivatives(degree, first.data(), second.data());
  }
};

}  // namespace

template <typename T>
Eigen::Matrix3d polynomialHessian(const T* coefficients, int degree, const std::array<double, 3>& local) {
  const LegendreDerivatives x(local[0], degree), y(local[1], degree), z(local[2], degree);
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  for (int i = 0; i <= degree; ++i) {
    double plane = 0, planeY = 0, planeZ = 0, planeYy = 0, planeYz = 0, planeZz = 0;
    for (int j = 0; i + j <= degree; ++j) {
      double line = 0, lineZ = 0, lineZz = 0;
      for (int k = 0; i + j + k <= degree; ++k) {
        const double coefficient = *coefficients++;
        line += coefficient * z.value[k];
        lineZ += coefficient * z.first[k];
        lineZz += coefficient * z.second[k];
      }
      plane += line * y.value[j];
      planeY += line * y.first[j];
      planeZ += lineZ * y.value[j];
      planeYy += line * y.second[j];
      planeYz += lineZ * y.first[j];
      planeZz += lineZz * y.value[j];
    }
    xx += plane * x.second[i];
    xy += planeY * x.first[i];
    xz += planeZ * x.first[i];
    yy += planeYy * x.value[i];
    yz += planeYz * x.value[i];
    zz += planeZz * x.value[i];
  }
  return Eigen::Matrix3d{{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}};
}

template Eigen::Matrix3d polynomialHessian(const double*, int, const std::array<double, 3>&);
template Eigen::Matrix3d polynomialHessian(const float*, int, const std::array<double, 3>&);

void evaluateLeaf(const QuantizedCoefficients& coefficients, const GridFrame& frame, const LeafPoint& leaf,
                  ValueGradientHessian& result) {
  ValueAndGradient first;
  evaluateLeaf(coefficients, frame, leaf, first);
  setFirstDerivatives(result, first);
  std::array<double, std::size_t(coefficientCount(kMaxDegree))> decoded;
  decodeLeaf(coefficients, leaf.bits, decoded.data());
  result.hessian = polynomialHessian(decoded.data(), node::degree(leaf.bits), leaf.local);
  toWorldUnits(frame, leaf, result.hessian);
}

}  // namespace hpsdf::query
