#pragma once
// The greatest error of a cell's polynomial, by probing.

#include <span>
#include <vector>

#include "field/cells/cell_fit.h"

namespace hpsdf::detail {

/// The probes of a cell in local coordinates: a lattice of 8 × 8 × 8 points from corner to corner.
std::span<const Vector3> maxErrorProbes();

/// The greatest |f − Φ| at the probes, plus half of its greatest step between two neighbouring probes: the error is
/// assumed to rise no faster between probes than from probe to probe. `exact` holds Φ at the probes; probes with |Φ|
/// above `farthest` do not count.
double worstError(const Fit& fit, std::span<const double> exact, double farthest);

/// The greatest distance of a point of a cell from the closest probe. `cellDiagonal` is the length of its diagonal.
double probeSpacing(double cellDiagonal);

}  // namespace hpsdf::detail
