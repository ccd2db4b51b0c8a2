#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "contour/cell_samples.h"
#include "contour/contour_octree.h"
#include "contour/implicit_surface.h"
#include "hpsdf/error.h"
#include "hpsdf/types.h"

namespace hpsdf::contouring {

/// An edge of the octree's smallest leaves around it, which the surface crosses: its ends have different signs.
struct CrossedEdge {
  GridPoint lower;    ///< the end with the lower coordinate
  std::int32_t axis;  ///< 0 to 2
  std::int32_t size;  ///< length in units of the smallest cells
  bool lowerInside;   ///< the end `lower` is inside
  /// The leaves around the edge, in counter-clockwise order as seen from its upper end: before the edge along both
  /// other axes (axis + 1, axis + 2), beyond it along the first of these, beyond both, beyond the second. A greater
  /// leaf may occur twice in succession. −1 outside the octree.
  std::array<std::int32_t, 4> cells;
  std::array<double, 2> values;  ///< the function at the lower and the upper end
  Vector3 point;                 ///< where the surface crosses the edge
  Vector3 normal;                ///< unit vector along the gradient there
};

/// Finds all crossed edges of the given leaves, in their order. The points of crossing are within `accuracy` of a
/// change of sign.
std::vector<CrossedEdge> findCrossedEdges(const ImplicitSurface& surface, const ContourOctree& octree,
                                          std::span<const std::int32_t> leaves, const std::vector<CellSamples>& samples,
                                          double accuracy, const Progress& progress);

}  // namespace hpsdf::contouring
