#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "hpsdf/types.h"

namespace hpsdf::distance {

/// A sum of angles, by the product of complex numbers that have them: one arc tangent at its end, and a count of whole
/// turns.
class AngleSum {
 public:
  /// The angle of x + iy, in (−π, π].
  void add(double x, double y) {
    if (x == 0 && y == 0) return;
    const double real = real_ * x - imaginary_ * y, imaginary = real_ * y + imaginary_ * x + 0.0;  // no −0
    if (y > 0 && imaginary_ >= 0 && imaginary < 0) ++turns_;
    if (y < 0 && imaginary_ < 0 && imaginary >= 0) --turns_;
    if (y == 0 && x < 0 && (imaginary_ > 0 || (imaginary_ == 0 && real_ < 0))) ++turns_;  // by half a turn
    const double size = std::abs(real) + std::abs(imaginary);
    const double scale = size < 1e-100 ? 1e100 : size > 1e100 ? 1e-100 : 1;
    real_ = scale * real;
    imaginary_ = scale * imaginary;
  }

  double value() const { return std::atan2(imaginary_, real_) + 2 * std::numbers::pi * turns_; }

 private:
  double real_ = 1, imaginary_ = 0;
  int turns_ = 0;
};

/// Adds half of the solid angle of a triangle with these corners, seen from the origin (van Oosterom and Strackee
/// 1983); above 0 where the origin is behind it.
inline void addHalfAngle(const Vector3& a, const Vector3& b, const Vector3& c, AngleSum& sum) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm(), product = la * lb * lc;
  if (product > 0) sum.add(1 + (a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb) / product, a.dot(b.cross(c)) / product);
}

}  // namespace hpsdf::distance
