#pragma once

#include <vector>

#include "hpsdf/output/sample_points.h"

namespace hpsdf::samples {

/// Points that were drawn, in the order of their kinds.
struct DrawnPoints {
  std::vector<Vector3> points;
  std::vector<PointKind> kinds;
  std::vector<Vector3> edgeNormals;  ///< one for each point of `PointKind::edge`
};

/// Draws the points that the options ask for from a surface. Each point has random numbers of its own, so that it
/// depends only on the seed, its kind and its number within the kind. Throws `Error` if a coordinate exceeds
/// `kLargestCoordinate` or, rounded to float, the range of floats, and `Cancelled` when `progress` says so.
DrawnPoints drawPoints(const TriangleMesh& surface, const SamplePointsOptions& options, const Progress& progress);

/// Returns the unit normal of a triangle, or 0 for a triangle without area.
Vector3 normalOf(const TriangleMesh& mesh, std::size_t triangle);

/// Returns the box in which uniform points are drawn.
Box uniformBox(const TriangleMesh& surface, double enlargement);

}  // namespace hpsdf::samples
