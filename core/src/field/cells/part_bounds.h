#pragma once

// Bounds of the error of a polynomial over a box, from values of the distance at points around it.

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "hpsdf/detail/legendre_part.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/types.h"

namespace hpsdf::detail {

/// A leaf's polynomial over a part of the leaf, in local coordinates of the part.
struct Part {
  Vector3 center, half;              ///< in the field's units
  double value = 0;                  ///< constant coefficient: the linear polynomial's value at the centre
  Vector3 gradient;                  ///< gradient of the linear polynomial
  std::array<double, 3> squares{};   ///< coefficients of L_2 along each axis
  std::array<double, 3> products{};  ///< coefficients of the products yz, xz, xy
  double rest = 0;                   ///< bound of the terms of degree 3 and more
};

/// Makes a part with this centre and half edges. `cube` holds the polynomial's coefficients in local coordinates of the
/// part, as a cube of (degree + 1)³ numbers.
Part partOf(std::span<const double> cube, int degree, const Vector3& center, const Vector3& half);

/// Returns an upper bound of sign · f(x) + |x − y| over all points x of a part with the polynomial f, for one point y.
/// The sign is 1 or −1.
double coneBound(const Part& part, double sign, const Vector3& y);

/// The polynomial of a leaf over a box, and the coefficients as for `partOf`.
struct BoxPolynomial {
  std::vector<double> cube;
  int degree;
  Part part;
};

/// Upper bounds of |f − Φ| and ‖∇f‖, and the number of evaluations of the distance that they took.
struct ErrorBound {
  double error = 0;
  double slope = std::numeric_limits<double>::infinity();
  std::uint64_t evaluations = 0;
};

/// The parameters with which the errors of polynomials are bounded.
struct ErrorQuestion {
  std::uint64_t mostEvaluations;  ///< for each polynomial, at least 8
  const DistanceFunction& distance;
  const Box& domain;                  ///< where the distance may be evaluated
  const LegendreRows &lower, &upper;  ///< `legendreOfPart` for the two halves of a cell
};

/// Returns for each leaf upper bounds of the error |f − Φ| and of the slope of its polynomial f over a box. The bounds
/// do not depend on which other leaves are in the list. It takes less time for several leaves that are close to each
/// other than for each on its own, as the distance is evaluated at more points at a time. Throws `Error` if Φ is not
/// finite.
std::vector<ErrorBound> boundErrors(std::span<const BoxPolynomial> leaves, const ErrorQuestion& question);

}  // namespace hpsdf::detail
