#pragma once
// Linear enclosures: two parallel linear functions between which a field lies in a part of the domain.

#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf::range {

/// Bounds of a function f over the cube [−w, w]³ of local coordinates t: f(t) lies between `lower` + g·t and `upper` +
/// g·t, with g = `gradient`, and between `min` and `max`. The numbers are not rounded outward: whoever stores them adds
/// `noise` and the rounding errors of what is computed from them.
struct Enclosure {
  double lower = 0, upper = 0;
  Vector3 gradient = Vector3::Zero();
  double min = 0, max = 0;
  /// Bound of Σ |∂²f/∂tₐ∂t_b| over all a and b, by which f at one point bounds f around the point. It is 0 for
  /// functions that are not polynomials.
  double bend = 0;
  double noise = 0;  ///< greatest rounding error of f where a query computes it
  double error = 0;  ///< bound of |f − Φ|; 0 if there is none
  /// True for a distance whose sign may be wrong, so that f may be both the distance and its opposite.
  bool isSignUncertain = false;
};

/// Returns the enclosure over [−1, 1]³ of a polynomial whose coefficients are arranged as a cube of (degree + 1)³
/// numbers.
Enclosure enclosureOf(const std::vector<double>& cube, int degree);

/// The places of the parts of a cell in it: part number x + 2y + 4z has its centre at `offset` from that of the cell
/// along each axis, and its local unit is `unit`, both in local units of the cell. Its enclosure is known over [−reach,
/// reach]³ of its own coordinates.
struct PartLayout {
  double offset, unit, reach;
};

/// The enclosures of the eight parts of a cell. Parts outside the domain have none.
using Parts = std::array<std::optional<Enclosure>, 8>;

/// Returns an enclosure of all parts in the local coordinates of the cell.
Enclosure unionOf(const Parts& parts, const PartLayout& layout);

/// Returns the range that two enclosures of the same function leave: the greater minimum and the smaller maximum.
void tighten(Enclosure& enclosure, const Enclosure& other);

}  // namespace hpsdf::range
