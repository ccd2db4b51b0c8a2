#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "hpsdf/types.h"

namespace hpsdf::sign {

/// A sum of angles that needs only one arc tangent in all. It multiplies complex numbers that have the angles as
/// arguments, and counts the full turns.
class AngleSum {
 public:
  AngleSum() = default;
  /// Continues from a complex number with the angle of the sum, and a number of full turns.
  AngleSum(double real, double imaginary, double turns) : real_(real), imaginary_(imaginary), turns_(turns) {}

  /// Adds the angle of the complex number x + iy, in (−π, π]. Adds nothing if x and y are 0.
  void add(double x, double y) {
    if (x == 0 && y == 0) return;
    const double real = real_ * x - imaginary_ * y;
    const double imaginary = real_ * y + imaginary_ * x + 0.0;  // the 0.0 turns −0 into 0
    // The arc tangent of the product jumps by 2π when the sum of the angles passes an odd multiple of π.
    if (y > 0 && imaginary_ >= 0 && imaginary < 0) ++turns_;
    if (y < 0 && imaginary_ < 0 && imaginary >= 0) --turns_;
    const bool addsHalfTurn = y == 0 && x < 0;
    if (addsHalfTurn && (imaginary_ > 0 || (imaginary_ == 0 && real_ < 0))) ++turns_;
    // Rescale the product, which would overflow or underflow after many factors. Its angle does not change.
    const double size = std::abs(real) + std::abs(imaginary);
    const double scale = size < 1e-100 ? 1e100 : size > 1e100 ? 1e-100 : 1;
    real_ = scale * real;
    imaginary_ = scale * imaginary;
  }

  /// Returns the sum in radians.
  double value() const { return std::atan2(imaginary_, real_) + 2 * std::numbers::pi * turns_; }

 private:
  double real_ = 1, imaginary_ = 0;
  double turns_ = 0;
};

/// Adds half of the signed solid angle of the triangle abc, seen from the origin (van Oosterom and Strackee
/// 1983). The solid angle is positive if the origin lies behind the triangle.
inline void addHalfSolidAngle(const Vector3& a, const Vector3& b, const Vector3& c, AngleSum& sum) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm(), product = la * lb * lc;
  if (product > 0) sum.add(1 + (a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb) / product, a.dot(b.cross(c)) / product);
}

}  // namespace hpsdf::sign
