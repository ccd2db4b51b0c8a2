#pragma once
// Shapes that need no file: as triangle meshes, and where the distance has a closed form also as that.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/distance_function.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::shapes {

/// A number that a shape takes. All lengths are in mesh units.
struct Parameter {
  std::string name;
  double defaultValue;
  double minimum;
  double maximum;
  bool whole;  ///< counts: a whole number is expected
  std::string help;
};

struct Shape {
  std::string name;
  std::string help;
  std::vector<Parameter> parameters;
  bool analytic;  ///< `distance` knows this shape
};

/// All shapes, in the order in which to list them: sphere, torus, box, gear, helix-bowl, marble-run,
/// structured-bowl.
std::span<const Shape> catalogue();

/// `spec` is `NAME` or `NAME,parameter=value,…`, with or without a leading `builtin:`; e.g.
/// "torus,major=0.7,minor=0.3". The mesh is closed, its faces look outward, and it is centred at the origin. Throws
/// `Error` for an unknown name or parameter or a value out of range, naming the nearest known one.
TriangleMesh mesh(std::string_view spec);

/// The signed distance in closed form, its `source()` holding name and box, so that a field can be built without a
/// mesh. Spec as in `mesh`, with or without a leading `analytic:`. Throws `Error` for a shape without a closed form
/// too.
DistanceFunction analytic(std::string_view spec);

/// Exact signed distances, negative inside, of shapes centred at the origin.
double sphereDistance(const Vector3& x, double radius);
double torusDistance(const Vector3& x, double majorRadius, double minorRadius);  ///< axis z
double boxDistance(const Vector3& x, const Vector3& halfSize);

}  // namespace hpsdf::shapes
