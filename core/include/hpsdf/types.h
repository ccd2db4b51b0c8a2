#pragma once
// Basic value types that all libraries of the project share.

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace hpsdf {

using Vector3 = Eigen::Vector3d;

/// An axis-aligned box with the corners `min()` and `max()` in world units.
using Box = Eigen::AlignedBox3d;

/// A uniform scale about a centre: y = scale·(x − center).
struct Normalization {
  Vector3 center = Vector3::Zero();
  double scale = 1;

  bool isIdentity() const { return scale == 1 && center.isZero(0); }
};

/// The numbers from `min` to `max`, both included.
struct Interval {
  double min = 0;
  double max = 0;

  bool contains(double number) const { return number >= min && number <= max; }
  double width() const { return max - min; }
};

constexpr int kMaxDegree = 30;  ///< highest total degree of a leaf's polynomial
/// Stands in place of the degree of an exact leaf, which has no polynomial but a list of triangles.
constexpr int kExactDegree = kMaxDegree + 1;
constexpr int kMaxDepth = 20;  ///< greatest depth of a leaf; local coordinates then keep 32 of a double's 52 bits

/// Greatest width of the zones in which neighbouring leaves are blended (`FieldData::blend`). With a greater width, the
/// zones at opposite faces of a cell could meet.
constexpr double kMaxBlend = 0.25;

/// Returns n(p) = (p+1)(p+2)(p+3)/6, the number of coefficients of a polynomial of total degree p (Koschier et
/// al. 2016, sec. 3.3).
constexpr int coefficientCount(int degree) { return (degree + 1) * (degree + 2) * (degree + 3) / 6; }

}  // namespace hpsdf
