#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "field/cells/cell_fit.h"

namespace hpsdf::detail {

/// Returns the points, in local coordinates, at which the error of a cell is measured: a lattice of 8 × 8 × 8 points
/// between opposite corners of the cell.
const std::vector<Vector3>& probePoints();

/// Estimates the greatest error |f − Φ| of the fit f to the exact distance Φ in a cell: the greatest error at the probe
/// points, plus half of the greatest difference between the errors f − Φ at two neighbouring probes. It assumes that
/// errors rise no faster between probes than from probe to probe. `exact` holds Φ at the probes. Probes with |Φ| above
/// `farthest` do not count.
double worstError(const Fit& fit, std::span<const double> exact, double farthest);

/// Returns the greatest distance from a point of a cell to its closest probe. `cellDiagonal` is the length of
/// the cell's diagonal.
double probeSpacing(double cellDiagonal);

/// Fits polynomials of low degrees to a cell. Returns the first one whose estimated greatest error does not exceed
/// `tolerance`, as a final fit, or std::nullopt if there is none. Calls `maySample` before it probes the first one, and
/// returns std::nullopt if the answer is false: the probes could then miss something.
std::optional<Fit> fitWithin(const CellFitter& fitter, const Box& cell, double tolerance, int mostDegree,
                             const std::function<bool()>& maySample);

}  // namespace hpsdf::detail
