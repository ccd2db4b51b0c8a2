#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/mesh_report.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf {

class TriangleSearch;

struct ClosestPoint {
  Vector3 point;           ///< on the surface
  double signedDistance;   ///< negative inside
  std::uint32_t triangle;  ///< index in the mesh
  Feature feature;
  /// The number k of the edge from the triangle's corner k to its corner k + 1 (cyclically), or the number of the
  /// vertex among the triangle's corners; 0 for a face.
  std::uint8_t featureIndex = 0;
  /// The barycentric coordinates of `point`: the sum of the triangle's corners weighted by them is `point`, but for
  /// rounding. They are at least 0, their sum is 1, and they agree with `feature`: corners that do not belong to the
  /// edge or vertex have the weight 0.
  Vector3 barycentric = Vector3::Zero();
};

struct DistanceOptions {
  InsideTest insideTest = InsideTest::automatic;
  double thickness = 0;  ///< thickness of the wall for `InsideTest::shell`, above 0; 0 for other tests
  int threads = 0;       ///< greatest number of threads, 0 for all; the result does not depend on it
};

/// Exact signed distance to a triangle mesh in double precision.
///
/// The unsigned distance comes from a search for the nearest triangle in a hierarchy of oriented boxes, which takes
/// up to sixteen points at a time. The sign comes from an inside test:
/// - `InsideTest::pseudonormal`: the sign of the dot product of the vector from the closest point to the query point
///   with the angle-weighted pseudonormal of the closest face, edge or vertex (Bærentzen & Aanæs 2005). It is right
///   for closed meshes without self-intersections.
/// - `InsideTest::winding`: a point is inside if the generalised winding number w is above ½ (Jacobson et al. 2013).
///   The result is the same as with the exact sum over all triangles. The set of points with w = ½ closes holes and
///   counts as surface; the distance to this set is |w − ½|/|∇w|, to first order. If a closed mesh is oriented inward,
///   the space around the mesh counts as inside.
/// - `InsideTest::outerHull`: the sign and the distances of outside points are those of `winding`. For points inside,
///   triangles with the inside on both sides, such as inner walls of overlapping bodies, do not count as surface.
///   Triangles that intersect each other are first divided into pieces, down to 1/512 of the mesh's size.
/// - `InsideTest::shell`: half of the thickness is subtracted from the unsigned distance. This test suits open sheets.
/// - `InsideTest::automatic`: `pseudonormal` if this test is certain to be right, else `winding`.
///
/// Among equally near triangles, the one with the lowest index counts. Therefore results depend neither on the order
/// nor on the grouping of queries, and single and batched queries agree bit for bit.
///
/// A triangle is degenerate if its height is within the rounding errors of its coordinates. The distance to a
/// degenerate triangle is the distance to its edges. Degenerate triangles do not contribute to pseudonormals. A point
/// that is not finite gets a value that is not finite. Points farther than 2²⁷ times the mesh's size have the closest
/// point of a nearer point in the same direction, because rounding hides which triangle is nearest to them; distances
/// and signs are right there, too.
///
/// Objects are const and thread-safe after construction. They keep no reference to the mesh.
class ExactDistance {
 public:
  /// Prepares the distance queries to a mesh. Throws `Error` for a mesh without triangles, with indices out of range or
  /// with coordinates that are not finite or beyond `kLargestCoordinate`. Throws `Error` for a thickness that does not
  /// fit the inside test. For the outer hull, throws `Error` if the mesh has more than two million pairs of
  /// intersecting triangles, or if their subdivision into pieces of 1/32 of the mesh's size would add more than 250,000
  /// triangles. Throws `Cancelled` when `progress` says so.
  explicit ExactDistance(const TriangleMesh& mesh, const DistanceOptions& options = {}, const Progress& progress = {});
  ~ExactDistance();
  ExactDistance(ExactDistance&&) noexcept;
  ExactDistance& operator=(ExactDistance&&) noexcept;

  double operator()(const Vector3& x) const;

  /// Evaluates the signed distance at many points. It is fastest if successive points are close in space. Both
  /// spans must have the same length.
  void operator()(std::span<const Vector3> points, std::span<double> out) const;

  /// Returns true if `withGradients` can be called: unless the signed distance is, at some points, the distance to
  /// something other than the nearest triangle. That is the case for an outer hull, and near a hole that the winding
  /// number closes.
  bool hasGradients() const;

  /// Evaluates the signed distance as `operator()` does, together with its gradient: a unit vector from the nearest
  /// point of the surface to the query point, or the opposite one inside. Where rounding hides this direction, the
  /// gradient is the normal of the nearest triangle. All spans must have the same length, and `hasGradients` must be
  /// true.
  void withGradients(std::span<const Vector3> points, std::span<double> out, std::span<Vector3> gradients) const;

  /// Returns the point of the triangles that is nearest to x, together with the signed distance that `operator()`
  /// returns. For `InsideTest::outerHull` the triangles are those of the outer hull. For a shell, and near a hole that
  /// the winding number closes, the signed distance is not the distance to the returned point.
  ///
  /// For an outer hull, whose triangles may be pieces of the mesh's, feature and barycentric coordinates are those of
  /// the point in the mesh's triangle; a weight within rounding of 0 counts as 0.
  ClosestPoint closestPoint(const Vector3& x) const;

  /// Finds the closest points of many points, as `closestPoint` does and with the same results to the bit, in hardly
  /// more time than `operator()` takes for the distances alone. It is fastest if successive points are close in space.
  /// Both spans must have the same length.
  void closestPoints(std::span<const Vector3> points, std::span<ClosestPoint> out) const;

  /// Greatest error of a winding number of a mesh with holes.
  static constexpr double kWindingError = 1e-4;

  /// Returns the generalised winding number of the mesh about x (Jacobson et al. 2013), for any inside test. For a mesh
  /// without holes it is a whole number: 0 outside, 1 inside, more where bodies overlap, and on the surface that of one
  /// of its sides. For a mesh with holes its error is at most `kWindingError`. The winding number of an outer hull is
  /// that of the whole mesh. A point that is not finite has the winding number 0.
  ///
  /// Inside tests other than `winding` and `outerHull` need no winding numbers. With such a test, the first call
  /// prepares them: from then on, the object holds some 200 bytes more for each triangle, which `bytes` counts.
  double windingNumber(const Vector3& x) const;

  /// Computes the winding numbers of many points, as `windingNumber` does and with the same results to the bit. Both
  /// spans must have the same length.
  void windingNumbers(std::span<const Vector3> points, std::span<double> out) const;

  const InsideTestChoice& insideTestChoice() const;

  /// Returns the triangles to which distances are measured. For an outer hull, some of them are pieces of
  /// subdivided triangles. These pieces have their own vertices, which are not shared with other triangles.
  TriangleMesh surface() const;

  /// Returns the self-intersections of the mesh, as `findCrossings` does.
  Crossings crossings(std::size_t limit = kMaxCrossings, const Progress& progress = {}) const;

  /// Returns the description of the mesh: its name, fingerprint, counts, box and inside test.
  const Source& source() const;

  /// Returns the search from which the construction of a field makes exact leaves. It refers to this object.
  const TriangleSearch& triangleSearch() const;

  /// Returns the bytes held by this object: triangles, hierarchy, pseudonormals, and moments of the winding
  /// number.
  std::size_t bytes() const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

/// Returns the name of the instruction set that exact distances use on this machine, such as "AVX2". The
/// instruction set affects only the speed: distances are the same to the bit.
std::string_view instructionSet();

}  // namespace hpsdf
