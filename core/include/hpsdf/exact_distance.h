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

/// The part of a triangle that holds a closest point.
enum class Feature : std::uint8_t { face, edge, vertex };

struct ClosestPoint {
  Vector3 point;          ///< on the surface
  double signedDistance;  ///< negative inside
  std::uint32_t triangle;
  Feature feature;
};

struct DistanceOptions {
  InsideTest insideTest = InsideTest::automatic;
  double thickness = 0;  ///< of a shell, in world units: above 0 for one, else 0
  int threads = 0;       ///< at most, 0: all. The result does not depend on them.
};

/// Exact signed distance to a triangle mesh in double precision.
///
/// Unsigned distance: nearest triangle by a hierarchy of oriented boxes, eight points of a batch at a time.
///
/// Sign, one of four, or `InsideTest::automatic`: the first where it is certain to be right, else the second.
/// * `InsideTest::pseudonormal`: dot product of (x - closest point) with the angle-weighted pseudonormal of the closest
///   feature (Bærentzen & Aanæs 2005): right for closed meshes that do not meet themselves.
/// * `InsideTest::winding`: inside is where the generalised winding number is above ½ (Jacobson et al. 2013), decided
/// as the
///   sum over all triangles has it. Where the mesh has holes, the surface on which it is ½ closes them and counts as
///   surface: |w − ½|/|∇w| away, to first order. In a closed mesh that looks inwards, outside and inside are exchanged.
/// * `InsideTest::outerHull`: the same sign, and outside the same distance, but triangles that have the inside on both
/// sides, such
///   as walls within bodies that overlap, are no surface to what is inside. One that meets others counts, or is left
///   out, up to a five-hundredth of the mesh's size beyond that.
/// * `InsideTest::shell`: half of the thickness less than the unsigned distance. For sheets.
///
/// Equal distances are decided by the lower triangle index, so that a result depends on neither the order nor the
/// grouping of queries: single and batched queries agree bit for bit.
///
/// A triangle without area (its height within the roundings of its coordinates) answers by its sides and adds nothing
/// to the pseudonormals. A point that is not finite gets a value that is not finite; the sign is lost where the
/// distance exceeds the mesh by so much (some 1e15) that all triangles are equally near.
///
/// Const and thread-safe after construction. Keeps no reference to the mesh.
class ExactDistance {
 public:
  /// Throws `Error` for a mesh without triangles, with indices out of range or with non-finite coordinates, for a
  /// thickness that does not go with the sign, and for a hull of a mesh that meets itself in more than
  /// two million pairs of triangles, or would be cut into more than 250,000 pieces of a thirty-second of its size.
  /// Throws `Cancelled`.
  explicit ExactDistance(const TriangleMesh& mesh, const DistanceOptions& options = {}, const Progress& progress = {});
  ~ExactDistance();
  ExactDistance(ExactDistance&&) noexcept;
  ExactDistance& operator=(ExactDistance&&) noexcept;

  double operator()(const Vector3& x) const;

  /// Batched: fastest when neighbours in `points` are neighbours in space. The spans have equal length.
  void operator()(std::span<const Vector3> points, std::span<double> out) const;

  /// The nearest point of the triangles, of a hull those that are left. Its signed distance is that of `operator()`:
  /// beside a closed hole, and of a shell, not the distance to the point.
  ClosestPoint closestPoint(const Vector3& x) const;

  const InsideTestChoice& insideTestChoice() const;

  /// The triangles that distances go to. Of a hull, what is left of a triangle that was cut has vertices of its own.
  TriangleMesh surface() const;

  /// `findCrossings` of the mesh.
  Crossings crossings(std::size_t limit = kMostCrossings, const Progress& progress = {}) const;

  /// Name, fingerprint, counts, box and sign of the mesh.
  const Source& source() const;

  /// Bytes held: triangles, hierarchy, pseudonormals, moments of the winding number.
  std::size_t bytes() const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

/// The instruction set that exact distances run on here, such as "AVX2". It changes the speed alone: the distances are
/// the same to the bit.
std::string_view instructionSet();

}  // namespace hpsdf
