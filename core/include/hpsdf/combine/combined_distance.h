#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "hpsdf/combine/expression.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// The signed distance of an expression of solids. It converts to a `DistanceFunction`, from which `build` makes a
/// field.
///
/// Unions, intersections and differences of closed meshes are exact everywhere: triangles are cut where others cross
/// them, and the distance is measured to those pieces that bound the result. Moves, rotations and scales are applied to
/// the vertices of meshes. The sign is the Boolean expression of the signs of the meshes.
///
/// All other values come from the values of the operands, by minimum, maximum, sum and difference. All of these keep
/// the property of distances that they nowhere change faster than the position does (1-Lipschitz). Therefore the
/// magnitude of a value is at most the distance to the surface where the result is 0, so that no step of that length
/// passes through the surface. `exactness` tells on which side of the surface the values are exact:
/// * a closed mesh is exact everywhere; an open one, whose holes the winding number closes, is a bound, and so is one
///   upon which `InsideTest::pseudonormal` is forced;
/// * a distance function is exact, unless its source says otherwise; a field is a bound, up to its own error, and ends
///   at the walls of its domain, as a function does that `Expression::within` restricts to a box. At distance d outside
///   the domain, it has the value √(d² + f²), which no distance to a surface in the domain is below; f is its value at
///   the domain's nearest point, or 0 if that is inside;
/// * a union is exact outside if its operands are, an intersection inside; a difference is an intersection;
/// * an offset is exact outside if it is above 0, and inside if below 0, provided that its operand is exact there;
/// * a shell is exact outside its wall if its operand is exact everywhere;
/// * smooth operations are bounds.
///
/// Objects are const, thread-safe and cheap to copy. They keep no reference to the expression.
class CombinedDistance {
 public:
  /// Prepares the distance. `options` apply to all meshes. Throws `Error` for names that `withOperands` has not
  /// replaced, for meshes that `ExactDistance` refuses, for a Boolean expression of meshes of which nothing is left,
  /// and if the pieces of meshes do not fit into memory. Throws `Cancelled` when `progress` says so.
  explicit CombinedDistance(const Expression& expression, const DistanceOptions& options = {},
                            const Progress& progress = {});

  double operator()(const Vector3& x) const;
  void operator()(std::span<const Vector3> points, std::span<double> out) const;

  /// Returns true if all operands know their gradients, so that `withGradients` can be called.
  bool hasGradients() const;
  void withGradients(std::span<const Vector3> points, std::span<double> out, std::span<Vector3> gradients) const;

  Exactness exactness() const;

  /// Returns a description: the expression as its name, a box that holds the surface, and the exactness. The box is
  /// empty if an operand has none.
  const Source& source() const;

  /// Returns the triangles that bound the result if the whole expression is a Boolean expression of closed meshes, else
  /// nullptr. All triangles face outward; those that were cut do not share their vertices.
  const TriangleMesh* boundary() const;

  std::size_t bytes() const;

 private:
  struct Data;
  std::shared_ptr<const Data> data_;
};

}  // namespace hpsdf
