#pragma once
// Random points on, near and around a surface with their signed distances, for the training and the testing of learned
// distance functions.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// The distribution from which a sample point is drawn.
enum class PointKind : std::uint8_t {
  surface,  ///< uniform by area on the surface
  edge,     ///< uniform by length on the surface's sharp edges
  near,     ///< a surface point, moved by a Gaussian of the first width (even numbers) or the second one (odd numbers)
  uniform,  ///< uniform in a box around the surface
};

/// The numbers of points and how they are drawn. The defaults for `near`, `uniform` and `widths` are those of DeepSDF
/// (Park et al. 2019), as its program PreprocessMesh sets them.
struct SamplePointsOptions {
  std::size_t surface = 250'000;  ///< number of points of `PointKind::surface`
  std::size_t edge = 0;           ///< number of points of `PointKind::edge`
  std::size_t near = 470'000;     ///< number of points of `PointKind::near`
  std::size_t uniform = 30'000;   ///< number of points of `PointKind::uniform`
  /// Standard deviations of the coordinates of near points, above 0, as shares of the surface's radius: its greatest
  /// distance from the center of its box. The defaults are √0.005 and √0.0005.
  std::array<double, 2> widths = {0.070710678118654752, 0.022360679774997897};
  /// An edge is sharp if the normals of its two faces differ by at least this angle, 0 to 180 degrees. Edges of one
  /// face or of more than two faces always are.
  double sharpAngleDegrees = 30;
  /// The box of uniform points is the surface's bounding box, enlarged on each side by this share of its longest side;
  /// 0 or more.
  double enlargement = 0.1;
  /// Rounds the points to `float` before their distances are computed, so that a file of floats has the distances of
  /// the very points that it holds.
  bool floatPoints = false;
  std::uint64_t seed = 1;  ///< seed of the random numbers
  int threads = 0;         ///< greatest number of threads, 0 for all; the samples do not depend on it
};

/// Sample points and what is known at them: parallel arrays, with all points of one kind in succession, in the order of
/// `PointKind`. Within a kind the order is random.
struct SamplePoints {
  std::vector<Vector3> points;
  std::vector<double> distances;   ///< signed distances, negative inside
  std::vector<Vector3> gradients;  ///< gradients of the signed distance, see `samplePoints`
  std::vector<PointKind> kinds;

  // The following arrays are empty for samples of a field.
  std::vector<Vector3> closest;      ///< the closest points of the triangles
  std::vector<std::uint32_t> faces;  ///< the mesh's triangles on which these points lie
  std::vector<Vector3> normals;  ///< unit normals of these triangles; for edge points, of the edge (mean of its faces)

  std::size_t size() const { return points.size(); }
};

/// Draws random points and computes their exact distances. `mesh` must be the mesh from which `distance` was made. For
/// an outer hull, points lie on the hull and its sharp edges.
///
/// Gradients are unit vectors. Nearer to the surface than rounding can tell they are the normals of the closest
/// triangles. Where the distance is not that to the closest triangle, beside a hole that the winding number closes, the
/// gradient is unknown and 0.
///
/// Throws `Error` if an option is out of range, if the mesh has no area or has no sharp edges although edge points are
/// asked for, if it is not the mesh of the distance, if coordinates of points exceed `kLargestCoordinate` or the range
/// of floats, and if the samples do not fit into memory. Throws `Cancelled` when `progress` says so.
///
/// @code
/// const TriangleMesh mesh = loadMesh("part.obj");
/// const SamplePoints samples = samplePoints(mesh, ExactDistance(mesh), {.near = 100'000, .seed = 7});
/// saveSamples(samples, "part.npz");  // hpsdf/output/sample_file.h
/// @endcode
SamplePoints samplePoints(const TriangleMesh& mesh, const ExactDistance& distance,
                          const SamplePointsOptions& options = {}, const Progress& progress = {});

/// Draws random points in the same way and evaluates a field at them. `mesh` is the surface from which they are drawn:
/// the mesh from which the field was made, or another surface. Gradients are those of the field, of any length. Throws
/// as the function above.
SamplePoints samplePoints(const TriangleMesh& mesh, const Field& field, const SamplePointsOptions& options = {},
                          const Progress& progress = {});

/// Does the same with the points drawn from the field's own contour (`blendedContour`), which ends where the domain
/// does. Throws `Error` besides if the field has the same sign everywhere.
SamplePoints samplePoints(const Field& field, const SamplePointsOptions& options = {}, const Progress& progress = {});

}  // namespace hpsdf
