#pragma once
// Built-in shapes. All are available as triangle meshes, and some also as signed distances in closed form.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/distance_function.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::shapes {

/// A numeric parameter of a built-in shape. All lengths are in mesh units.
struct Parameter {
  std::string name;
  double defaultValue;
  double minimum;
  double maximum;
  bool whole;  ///< the parameter is a count and takes whole numbers only
  std::string help;
};

struct Shape {
  std::string name;
  std::string help;
  std::vector<Parameter> parameters;
  bool analytic;  ///< the function `analytic` offers this shape's signed distance in closed form
};

/// Returns all built-in shapes in the order in which lists show them: sphere, torus, box, gear, helix-bowl,
/// marble-run, structured-bowl.
std::span<const Shape> catalogue();

/// Returns the mesh of a built-in shape. It is closed and centred at the origin, and its triangles face outward.
///
/// @param spec `NAME` or `NAME,parameter=value,…`, with or without a leading `builtin:`, such as
///   "torus,major=0.7,minor=0.3".
///
/// Throws `Error` (of the kind `option`, with the subject `spec`) for a value out of range and for an unknown name or
/// parameter. For an unknown name, the message suggests the most similar known name or lists all names.
TriangleMesh mesh(std::string_view spec);

/// Returns the signed distance of a built-in shape in closed form, with the shape's name and box as its
/// `source()`. `spec` is as for `mesh`, with or without a leading `analytic:`. Throws `Error` as `mesh` does,
/// and for a shape that has no closed form.
DistanceFunction analytic(std::string_view spec);

/// Return the exact signed distance, negative inside, from x to a shape that is centred at the origin.
double sphereDistance(const Vector3& x, double radius);
double torusDistance(const Vector3& x, double majorRadius, double minorRadius);  ///< the torus' axis is z
double boxDistance(const Vector3& x, const Vector3& halfSize);

}  // namespace hpsdf::shapes
