#include "surface/exact_orientation.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <limits>

namespace hpsdf::surface {
namespace {

/// The exact result of an arithmetic operation: the unevaluated sum of the rounded result and its rounding error.
struct Exact {
  double value, rest;
};

Exact sumOf(double a, double b) {
  const double sum = a + b, fromB = sum - a;
  return {sum, (a - (sum - fromB)) + (b - fromB)};
}

Exact differenceOf(double a, double b) { return sumOf(a, -b); }

Exact productOf(double a, double b) {
  const double product = a * b;
  return {product, std::fma(a, b, -product)};
}

/// An exact sum of doubles, stored as non-overlapping parts from the smallest to the greatest. Parts that
/// are 0 are removed (Shewchuk 1997, "Grow-Expansion").
class ExactSum {
 public:
  void add(double value) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const Exact sum = sumOf(value, parts_[i]);
      value = sum.value;
      if (sum.rest != 0) parts_[kept++] = sum.rest;
    }
    if (value != 0) parts_[kept++] = value;
    count_ = kept;
  }

  /// Adds the product sign·a·b to this sum exactly.
  void add(const Exact& a, const Exact& b, double sign) {
    for (const double x : {a.value, a.rest})
      for (const double y : {b.value, b.rest}) {
        const Exact product = productOf(sign * x, y);
        add(product.rest);
        add(product.value);
      }
  }
  /// Adds the product sign·a·b·c to this sum exactly.
  void add(const Exact& a, const Exact& b, const Exact& c, double sign) {
    for (const double x : {a.value, a.rest})
      for (const double y : {b.value, b.rest}) {
        if (x == 0 || y == 0) continue;
        const Exact product = productOf(sign * x, y);
        add({product.value, product.rest}, c, 1);
      }
  }

  /// Returns the sign of the sum, which is the sign of its part with the greatest magnitude.
  int sign() const { return count_ == 0 ? 0 : parts_[count_ - 1] > 0 ? 1 : -1; }

 private:
  std::array<double, 200> parts_;  // six products of three factors have at most 192 parts
  std::size_t count_ = 0;
};

constexpr double kEpsilon = std::numeric_limits<double>::epsilon() / 2;

/// Returns the sign of a rounded value if the sign is certain, else 2. The rounding error of the value is
/// at most `bound` times `magnitude` (Shewchuk 1997).
int roundedSign(double value, double magnitude, double bound) {
  if (value > bound * magnitude) return 1;
  if (-value > bound * magnitude) return -1;
  return magnitude == 0 ? 0 : 2;
}

}  // namespace

int orientation(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  const Vector3 u = b - a, v = c - a, w = d - a;
  double value = 0, magnitude = 0;
  for (int k = 0; k < 3; ++k) {
    const double left = v[(k + 1) % 3] * w[(k + 2) % 3], right = v[(k + 2) % 3] * w[(k + 1) % 3];
    value += u[k] * (left - right);
    magnitude += std::abs(u[k]) * (std::abs(left) + std::abs(right));
  }
  if (const int sign = roundedSign(value, magnitude, (7 + 56 * kEpsilon) * kEpsilon); sign != 2) return sign;

  ExactSum sum;
  std::array<Exact, 3> du, dv, dw;
  for (int k = 0; k < 3; ++k) {
    du[k] = differenceOf(b[k], a[k]);
    dv[k] = differenceOf(c[k], a[k]);
    dw[k] = differenceOf(d[k], a[k]);
  }
  for (int k = 0; k < 3; ++k) {
    sum.add(dv[(k + 1) % 3], dw[(k + 2) % 3], du[k], 1);
    sum.add(dv[(k + 2) % 3], dw[(k + 1) % 3], du[k], -1);
  }
  return sum.sign();
}

int orientation(const std::array<int, 2>& axes, const Vector3& a, const Vector3& b, const Vector3& c) {
  const auto [x, y] = axes;
  const double left = (b[x] - a[x]) * (c[y] - a[y]), right = (b[y] - a[y]) * (c[x] - a[x]);
  const int sign = roundedSign(left - right, std::abs(left) + std::abs(right), (3 + 16 * kEpsilon) * kEpsilon);
  if (sign != 2) return sign;

  ExactSum sum;
  sum.add(differenceOf(b[x], a[x]), differenceOf(c[y], a[y]), 1);
  sum.add(differenceOf(b[y], a[y]), differenceOf(c[x], a[x]), -1);
  return sum.sign();
}

}  // namespace hpsdf::surface
