#pragma once
// How far a cell's polynomial is off where it is worst.

#include <span>
#include <vector>

#include "field/build/cell_fit.h"

namespace hpsdf {

/// Where a cell is looked at: a lattice of 8 × 8 × 8 places from corner to corner, in local coordinates.
std::span<const Vector3> lookedAt();

/// The greatest |f − Φ| at these places, `exact` being Φ there, and half of the greatest step between two neighbours
/// beside it: between them the error rises as fast as it was seen to. Places whose |Φ| is above `farthest` do not
/// count.
double worstError(const Fit& fit, std::span<const double> exact, double farthest);

/// How far a point of a cell with this diagonal may be from the closest of the places.
double lookSpacing(double cellDiagonal);

}  // namespace hpsdf
