#pragma once
// Lower bounds of an exact leaf's values in boxes, also in boxes beyond the leaf.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "hpsdf/detail/field_data.h"

namespace hpsdf::physics {

/// Bounds the values of an exact leaf from below. The distance to the leaf's triangles changes no faster than the point
/// moves, everywhere in space. The sign may change without a zero where it follows from pseudonormals and the list
/// lacks the nearest triangles: beyond the leaf, where a blended field still uses it, and beside the holes of an open
/// mesh. So the sign counts as known only where all faces, edges and vertices that can be nearest agree on it. Where
/// the sign follows from the winding number, it may change behind edges that the listed triangles do not close.
class ExactLeafBound {
 public:
  /// Positions of triangles in the leaf's list.
  using Positions = std::vector<std::uint32_t>;

  /// Keeps a reference to the triangles. `leaf` is the packed node.
  ExactLeafBound(const ExactTriangles& exact, std::uint64_t leaf);

  /// Returns the positions of all triangles of the leaf.
  Positions all() const;

  /// Returns a lower bound of the leaf's values in a box. `candidates` are positions among which are all triangles that
  /// can be nearest to a point of the box. Those that certainly are not nearest to any point of the box are removed.
  /// Without `withSign`, the sign counts as unknown, which takes less time.
  double leastIn(const Box& box, bool withSign, Positions& candidates);

 private:
  /// A face, side or corner of a triangle. A point can be nearest to it only if the point lies in the region in which
  /// all triangles at this feature have no nearer point elsewhere. The region is an intersection of half spaces.
  struct Feature {
    struct HalfSpace {
      Vector3 outwards;  ///< unit vector
      double limit;
    };
    Vector3 at;                       ///< a point of the feature
    Vector3 normal;                   ///< pseudonormal, a unit vector
    std::vector<HalfSpace> region{};  ///< points x with outwards · (x − at) ≤ limit
  };
  struct Triangle {
    std::array<std::uint32_t, 3> index;  ///< numbers of the corners
    std::array<Vector3, 3> corner;
    std::array<Vector3, 3> direction;  ///< unit vectors along the sides, the first from corner 0 to corner 1
    std::array<double, 3> length;      ///< lengths of the sides
    Vector3 normal;                    ///< unit vector; 0 for a triangle without area
    std::vector<Feature> features{};   ///< found when they are needed

    /// Returns the unit vector in the triangle's plane that points across a side, into the triangle.
    Vector3 inwards(int side) const { return normal.cross(direction[side]); }
  };
  struct Ball {
    Vector3 center;
    double radius;
  };

  static Triangle triangleOf(const std::array<std::uint32_t, 3>& index, const std::array<Vector3, 3>& corner);
  static double distanceTo(const Triangle& triangle, const Vector3& x);
  /// Returns 1 or −1 if all features of the candidates that can be nearest to a point of the ball give this sign, else
  /// 0.
  int signIn(const Ball& ball, const Positions& candidates);
  /// Returns the sign in a ball without triangles for `ExactSign::winding`, or 0 if a segment from the reference point
  /// to a point of the ball may pass an edge at which the listed triangles end.
  int signByWinding(const Ball& ball) const;
  void findOpenEdges();
  void findFeatures(Triangle& triangle) const;
  static Feature faceOf(const Triangle& triangle);
  Feature sideOf(const Triangle& triangle, int side) const;
  Feature cornerOf(const Triangle& triangle, int corner) const;

  const ExactTriangles& exact_;
  std::uint64_t leaf_;
  ExactSign sign_;
  double offset_;
  std::vector<std::array<Vector3, 2>> openEdges_;  ///< for `ExactSign::winding`: edges at which the triangles end
  std::vector<Triangle> triangles_;
  std::vector<double> distances_;
};

}  // namespace hpsdf::physics
