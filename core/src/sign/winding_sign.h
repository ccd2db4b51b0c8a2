#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sign/boundary_edges.h"
#include "sign/winding_number.h"

namespace hpsdf::sign {

/// Returns a distance from a triangle at which points in front of the triangle and behind it can be tested. The
/// distance exceeds the rounding errors of coordinates in a mesh with the bounding box `box`.
double probeDistance(const Box& box);

/// The sign of distances to a mesh by the winding number: a point is inside if its winding number is above
/// ½.
///
/// The surface on which the winding number w is ½ closes every hole of the mesh, and counts as surface. The distance to
/// this surface is |w − ½|/|∇w| to first order. The smaller of this distance and the distance to the triangles counts.
class WindingSign {
 public:
  WindingSign() = default;

  /// Keeps a pointer to the hierarchy, which must not be moved or destroyed before this object. `edges` are
  /// the unbalanced edges of the same hierarchy. If a closed mesh is oriented inward, the space all around
  /// the mesh counts as inside.
  WindingSign(const bvh::Hierarchy& hierarchy, const TriangleMesh& mesh, BoundaryEdges edges);

  /// Like the constructor above, but for a mesh whose winding numbers alone are needed (`numberAt`).
  WindingSign(const bvh::Hierarchy& hierarchy, BoundaryEdges edges);

  /// Replaces unsigned distances to the triangles by signed distances. The closer the points lie together,
  /// the fewer winding numbers are computed. The result for a point does not depend on the other points.
  void applyTo(std::span<double> distances, std::span<const Vector3> points) const {
    applyTo(distances, points, distances);
  }

  /// Replaces unsigned distances by signed distances for a mesh in which some triangles do not count as surface.
  /// `distances` are the distances to the nearest triangle that counts, `clearances` the distances to the nearest of
  /// all triangles. For points outside, the clearance is a valid distance, because other triangles hide the triangles
  /// that have the inside on both sides.
  void applyTo(std::span<double> distances, std::span<const Vector3> points, std::span<const double> clearances) const;

  /// Returns true if the triangle in `slot` has the outside in front of its centroid and the inside behind it. At the
  /// centroid, the winding number of all other triangles is the mean of the values on both sides of the triangle and
  /// must be about ½, or −½ for a mesh that is oriented inward. Probing a point on each side instead could jump over a
  /// nearby wall.
  bool separatesOutsideFromInside(std::uint32_t slot) const;

  /// The sides of a triangle.
  enum class Sides : std::uint8_t {
    unknown,     ///< none of the following, or not certain
    separates,   ///< the outside is in front of the triangle, the inside behind it
    bothInside,  ///< the inside is in front of the triangle and behind it
  };

  /// Returns what lies on the two sides of the triangle in `slot`, at its centroid (see `separatesOutsideFromInside`).
  /// In a mesh with holes, the same holds certainly at all points of the triangle, if no other triangle crosses it.
  Sides sidesOf(std::uint32_t slot) const;

  /// Returns true if the mesh has no holes, so that the winding number is constant where no triangle is crossed.
  bool isClosed() const { return edges_.empty(); }

  bool isInside(const Vector3& x) const;

  /// Returns true if at all points within `radius` of x every surface that closes a hole is certainly farther away than
  /// the triangles. `distance` is the distance of x from the triangles, which must not be so small that rounding
  /// decides on which side of them x is.
  bool isFarFromHoles(const Vector3& x, double radius, double distance) const;

  /// Returns the winding number at a point that lies on no triangle, rounded to a whole number, plus 1 in a mesh that
  /// is oriented inward, so that the point is inside if the result is above 0. In a mesh with holes, the point must be
  /// far from them (`isFarFromHoles`).
  std::int32_t windingAt(const Vector3& x) const;

  /// Returns the winding number at x: a whole number for a mesh without holes, and on its surface that of one of the
  /// two sides. In a mesh with holes the number is wrong by at most `error`. Returns 0 for a point that is not finite.
  double numberAt(const Vector3& x, double error) const;

  /// Returns true if all points within `radius` of x are certainly on the same side (inside or outside) as x, except
  /// points that a triangle separates from x.
  bool isSameSideWithin(const Vector3& x, double radius) const;

  std::size_t bytes() const { return winding_.bytes() + edges_.bytes(); }

 private:
  struct Sample;
  template <typename Enough>
  WindingNumber::Estimate windingNumber(const Vector3& x, double error, Enough isEnough) const;
  Sample sampleOf(const Vector3& x, double distance, const BoundaryEdges::Gradient& gradient) const;
  Sample sampleAt(const Vector3& x, double clearance, double distance) const;
  void applyToBatch(std::span<double> distances, std::span<const Vector3> points, std::span<const double> clearances,
                    std::vector<Sample>& samples) const;

  const bvh::Hierarchy* hierarchy_ = nullptr;
  WindingNumber winding_;
  BoundaryEdges edges_;
  double level_ = 0.5;  ///< winding number above which a point is inside
};

}  // namespace hpsdf::sign
