#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "field/cells/cell_fit.h"

namespace hpsdf::detail {

/// The points, in local coordinates, at which the error of a cell is measured: a lattice of 8 × 8 × 8 points between
/// opposite corners of the cell, in blocks of eight neighbours. Exact distances are fastest for such blocks.
struct ProbeLattice {
  static constexpr int kAcross = 8;  ///< number of points along each axis

  std::vector<Vector3> points;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> neighbours;  ///< pairs of points next to each other
};

const ProbeLattice& probeLattice();
inline const std::vector<Vector3>& probePoints() { return probeLattice().points; }

/// Calls visit(x, y, z) for all positions in a lattice with `across` points along each axis, in blocks of eight
/// neighbours. `across` is even.
template <typename F>
void forEachInBlocks(int across, const F& visit) {
  for (int z = 0; z < across; z += 2)
    for (int y = 0; y < across; y += 2)
      for (int x = 0; x < across; x += 2)
        for (int corner = 0; corner < 8; ++corner) visit(x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2));
}

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
