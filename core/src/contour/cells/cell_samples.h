#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "contour/cells/contour_octree.h"
#include "contour/cells/implicit_surface.h"
#include "hpsdf/error.h"

namespace hpsdf::contouring {

/// The function at the corners of a cell, and where the surface may pass through it at a lattice of 3 × 3 × 3 points,
/// reduced to what contouring needs.
struct CellSamples {
  std::array<double, 8> corners = {};  ///< values at the corners, in the order of children
  bool changesSign = false;            ///< the corners have different signs
  /// A sheet of the surface passes through the cell that its corners do not see: somewhere in the lattice, a point lies
  /// between two points of the other sign; if the corners have different signs, only a point with a clear value counts.
  bool hides = false;
  bool mayHide =
      false;  ///< the corners have the same sign, and the function may clearly have the other one in the cell
  /// The greatest distance between the tangent planes where the surface crosses the cell's edges and the point where
  /// they meet best, about the error of a mesh with a vertex there; 0 if the corners have the same sign.
  double misfit = 0;
};

inline bool isInside(double value) { return value < 0; }

/// Samples the function in cells. In cells whose corners have different signs, values of a magnitude up to `bulge` do
/// not count as clear; in others, those up to the surface's own limit.
void sampleCells(const ImplicitSurface& surface, const ContourOctree& octree, std::span<const std::int32_t> cells,
                 double bulge, const Progress& progress, std::vector<CellSamples>& samples);

}  // namespace hpsdf::contouring
