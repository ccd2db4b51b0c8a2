#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "contour/cells/cell_samples.h"
#include "contour/cells/contour_octree.h"
#include "contour/cells/implicit_surface.h"
#include "hpsdf/error.h"
#include "hpsdf/types.h"

namespace hpsdf::contouring {

/// The state of the polygon around a crossed edge after polygons were made for the last time.
struct PolygonState {
  bool isChanged = true;           ///< it has to be made and measured again
  bool isUntested = true;          ///< it was made after crossings were searched for the last time
  bool hasSecondDiagonal = false;  ///< if it has four corners: it is divided between the second and the fourth
  double error = 0;                ///< greatest magnitude of the function in it
};

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
  PolygonState polygon;
};

/// Brings a list of all crossed edges up to date after the octree's leaves were divided into cells from number
/// `firstNew` on. An edge that is still one of the smallest leaves around it stays, with the new leaves around it;
/// others are removed, and those of the new leaves are appended in the order of their leaves. The points of crossing
/// are within `accuracy` of a change of sign.
void updateCrossedEdges(const ImplicitSurface& surface, const ContourOctree& octree, std::size_t firstNew,
                        const std::vector<CellSamples>& samples, double accuracy, const Progress& progress,
                        std::vector<CrossedEdge>& edges);

}  // namespace hpsdf::contouring
