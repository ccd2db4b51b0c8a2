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

/// The part of a triangle on which a closest point lies.
enum class Feature : std::uint8_t { face, edge, vertex };

struct ClosestPoint {
  Vector3 point;           ///< on the surface
  double signedDistance;   ///< negative inside
  std::uint32_t triangle;  ///< index in the mesh
  Feature feature;
};

struct DistanceOptions {
  InsideTest insideTest = InsideTest::automatic;
  double thickness = 0;  ///< thickness of a shell in world units, above 0; 0 for other tests
  int threads = 0;       ///< greatest number of threads, 0 for all; the result does not depend on it
};

/// Exact signed distance to a triangle mesh in double precision.
///
/// The unsigned distance comes from a search for the nearest triangle in a hierarchy of oriented boxes, eight points at
/// a time. The sign comes from an inside test:
/// - `InsideTest::pseudonormal`: the dot product of x − closest point with the angle-weighted pseudonormal of the
///   closest feature (Bærentzen & Aanæs 2005). It is right for closed meshes without self-intersections.
/// - `InsideTest::winding`: a point is inside if the generalised winding number is above ½ (Jacobson et al. 2013). The
///   decision is that of the exact sum over all triangles. The surface on which the winding number is ½ closes holes
///   and counts as surface; its distance is |w − ½|/|∇w|, to first order. A closed mesh that is oriented inward has its
///   inside all around it.
/// - `InsideTest::outerHull`: the sign, and outside also the distance, are those of `winding`. Inside, triangles with
///   the inside on both sides, such as inner walls of overlapping bodies, do not count as surface. Along intersections
///   this is decided for pieces of 1/512 of the mesh's size.
/// - `InsideTest::shell`: half of the thickness is subtracted from the unsigned distance. It suits sheets.
/// - `InsideTest::automatic`: the first test if it is certain to be right, else the second.
///
/// The lowest index decides between equally near triangles: results depend neither on the order nor on the
/// grouping of queries, and single and batched queries agree bit for bit.
///
/// The distance to a degenerate triangle, whose height is within the rounding errors of its coordinates, is that to its
/// edges; it does not contribute to pseudonormals. A point that is not finite gets a value that is not finite. Signs
/// are lost at distances of about 10¹⁵ times the mesh's size, where all triangles are equally near.
///
/// Const and thread-safe after construction. Keeps no reference to the mesh.
class ExactDistance {
 public:
  /// Throws `Error` for a mesh without triangles, with indices out of range or with coordinates that are not finite;
  /// for a thickness that does not fit the inside test; and for an outer hull of a mesh with more than two million
  /// pairs of intersecting triangles, or one that would consist of more than 250,000 pieces of 1/32 of its size. Throws
  /// `Cancelled`.
  explicit ExactDistance(const TriangleMesh& mesh, const DistanceOptions& options = {}, const Progress& progress = {});
  ~ExactDistance();
  ExactDistance(ExactDistance&&) noexcept;
  ExactDistance& operator=(ExactDistance&&) noexcept;

  double operator()(const Vector3& x) const;

  /// Batched: fastest when neighbours in `points` are neighbours in space. The spans have equal length.
  void operator()(std::span<const Vector3> points, std::span<double> out) const;

  /// Returns the nearest point of the triangles, or of the outer hull's triangles for that test, with the signed
  /// distance of `operator()`. Near a closed hole and for a shell, this distance is not that to the returned point.
  ClosestPoint closestPoint(const Vector3& x) const;

  const InsideTestChoice& insideTestChoice() const;

  /// Returns the triangles to which distances are measured. For an outer hull, pieces of subdivided triangles have
  /// vertices of their own.
  TriangleMesh surface() const;

  /// Returns the crossings of the mesh by `findCrossings`.
  Crossings crossings(std::size_t limit = kMaxCrossings, const Progress& progress = {}) const;

  /// Returns name, fingerprint, counts, box and inside test of the mesh.
  const Source& source() const;

  /// Returns the bytes held: triangles, hierarchy, pseudonormals, moments of the winding number.
  std::size_t bytes() const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

/// Returns the instruction set that exact distances use on this machine, such as "AVX2". It affects the speed only:
/// distances are the same to the bit.
std::string_view instructionSet();

}  // namespace hpsdf
