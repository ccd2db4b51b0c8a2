#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "hpsdf/distance_function.h"
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

/// Exact signed distance to a triangle mesh in double precision.
///
/// Unsigned distance: nearest triangle by a hierarchy of oriented boxes, eight points of a batch at a time. Sign: dot
/// product of (x - closest point) with the angle-weighted pseudonormal of the closest feature (Bærentzen & Aanæs 2005):
/// right for closed meshes that do not intersect themselves. Equal distances are decided by the lower triangle index,
/// so that a result depends on neither the order nor the grouping of queries: single and batched queries agree bit for
/// bit.
///
/// A triangle without area (its height within the roundings of its coordinates) answers by its sides and adds nothing
/// to the pseudonormals. A point that is not finite gets a value that is not finite; the sign is lost where the
/// distance exceeds the mesh by so much (some 1e15) that all triangles are equally near.
///
/// Const and thread-safe after construction. Keeps no reference to the mesh.
class ExactDistance {
 public:
  /// Takes at most so many threads, 0 for all; the result does not depend on them. Throws `Error` for a mesh without
  /// triangles, with indices out of range or with non-finite coordinates.
  explicit ExactDistance(const TriangleMesh& mesh, int threads = 0);
  ~ExactDistance();
  ExactDistance(ExactDistance&&) noexcept;
  ExactDistance& operator=(ExactDistance&&) noexcept;

  double operator()(const Vector3& x) const;

  /// Batched: fastest when neighbours in `points` are neighbours in space. The spans have equal length.
  void operator()(std::span<const Vector3> points, std::span<double> out) const;

  ClosestPoint closestPoint(const Vector3& x) const;

  /// Name, fingerprint, counts and box of the mesh.
  const Source& source() const;

  /// Bytes held: triangles, pseudonormals and hierarchy.
  std::size_t bytes() const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

/// The instruction set that exact distances run on here, such as "AVX2". It changes the speed alone: the distances are
/// the same to the bit.
std::string_view instructionSet();

}  // namespace hpsdf
