#pragma once

#include <span>
#include <vector>

#include "sign/boundary_edges.h"
#include "sign/winding_number.h"

namespace hpsdf::sign {

/// Returns the distance from a triangle at which its two sides are probed: beyond the rounding errors of a mesh with
/// this box.
double probeDistance(const Box& box);

/// The sign of distances by the winding number: inside is where it is above ½.
///
/// The surface on which the winding number is ½ closes every hole, and counts as surface. Its distance is |w − ½|/|∇w|,
/// to first order, and replaces the distance to the triangles where it is smaller.
class WindingSign {
 public:
  WindingSign() = default;

  /// Keeps a pointer to the hierarchy, which must neither move nor end before this object. If a closed mesh is
  /// oriented inward, the space all around it counts as inside. `edges` are those of the hierarchy.
  WindingSign(const bvh::Hierarchy& hierarchy, const TriangleMesh& mesh, BoundaryEdges edges);

  /// Replaces unsigned distances to the triangles by signed distances. The closer the points are to each other, the
  /// fewer winding numbers are computed. The result of a point does not depend on the other points.
  void applyTo(std::span<double> distances, std::span<const Vector3> points) const {
    applyTo(distances, points, distances);
  }

  /// Does the same for a mesh in which some triangles do not count as surface. `distances` are those to the nearest
  /// triangle that counts, `clearances` those to the nearest of all triangles. Outside, the result is the clearance,
  /// because triangles with the inside on both sides lie behind others.
  void applyTo(std::span<double> distances, std::span<const Vector3> points, std::span<const double> clearances) const;

  /// Returns true if the triangle in a slot has the outside in front of its centroid and the inside behind it. Compares
  /// the winding number of all other triangles at the centroid with the mean of both sides: probing a point on each
  /// side could jump over a wall nearby.
  bool separatesOutsideFromInside(std::uint32_t slot) const;

  bool isInside(const Vector3& x) const;

  /// Returns true if it is certain that all points within `radius` of x, and not separated from x by a triangle, are on
  /// the same side as x.
  bool isSameSideWithin(const Vector3& x, double radius) const;

  std::size_t bytes() const { return winding_.bytes() + edges_.bytes(); }

 private:
  struct Sample;
  Sample sampleAt(const Vector3& x, double clearance, double distance) const;
  void applyToBatch(std::span<double> distances, std::span<const Vector3> points, std::span<const double> clearances,
                    std::vector<Sample>& samples) const;

  const bvh::Hierarchy* hierarchy_ = nullptr;
  WindingNumber winding_;
  BoundaryEdges edges_;
  double level_ = 0.5;  ///< winding number above which a point is inside
};

}  // namespace hpsdf::sign
