#pragma once

#include <span>
#include <vector>

#include "sign/boundary_edges.h"
#include "sign/winding.h"

namespace hpsdf::distance {

/// How far from a face of a mesh with this box its sides are asked for: beyond what rounds.
double besideSurface(const Box& box);

/// Gives distances their sign by the winding number: inside it is above ½. A surface on which it is ½ closes every
/// hole, and counts as surface: it is |w − ½|/|∇w| away, to first order, and where that is less than the distance to
/// the triangles, it is the distance.
class Inside {
 public:
  Inside() = default;

  /// Refers to the hierarchy, which must stay where it is. The inside of a closed mesh whose faces look inwards is all
  /// around it. `rims`: of the hierarchy's triangles.
  Inside(const Hierarchy& hierarchy, const TriangleMesh& mesh, BoundaryEdges rims);

  /// Makes signed ones, in place, of distances to the triangles, with the fewer winding numbers the closer together the
  /// points lie. A point gets the same alone and among others.
  void sign(std::span<const Vector3> points, std::span<double> distances) const { sign(points, distances, distances); }

  /// The same where some triangles do not count as surface: `free`, so far is the nearest of all, `distances`, so far
  /// the nearest of those that do. Outside it is as if all did: one that lies between inside and inside is behind
  /// others.
  void sign(std::span<const Vector3> points, std::span<const double> free, std::span<double> distances) const;

  /// Whether the triangle in a slot, at its middle, has the outside before it and the inside behind it: then the
  /// winding number of all others is there the middle of both. No step aside could leap over another wall.
  bool boundsInside(std::uint32_t slot) const;

  /// Whether a place is inside.
  bool contains(const Vector3& x) const;

  /// Whether all places are on the same side as x, for certain, that are no farther away than `reach` and not kept
  /// apart from it by a triangle.
  bool isSameWithin(const Vector3& x, double reach) const;

  /// Whether these places are inside, 1 or 0, each by a winding number of its own.
  std::vector<char> contains(std::span<const Vector3> places) const;

  std::size_t bytes() const { return winding_.bytes() + rims_.bytes(); }

 private:
  struct Known;
  Known find(const Vector3& x, double free, double distance) const;
  void signTogether(std::span<const Vector3> points, std::span<const double> free, std::span<double> distances,
                    std::vector<Known>& known) const;

  const Hierarchy* hierarchy_ = nullptr;
  Winding winding_;
  BoundaryEdges rims_;
  double level_ = 0.5;
};

}  // namespace hpsdf::distance
