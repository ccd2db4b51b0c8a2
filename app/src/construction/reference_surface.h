#pragma once
// Surfaces with which a finished field is compared.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "console/console.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_report.h"

namespace hpsdf::app {

/// A surface against which a field is measured, in the units of the field. For an analytic shape, `mesh` is
/// the mesh of the built-in shape of the same name, which differs only slightly from the analytic shape. For an
/// expression it is the boundary.
struct ReferenceSurface {
  std::shared_ptr<const DistanceFunction> distance;
  std::function<Vector3(const Vector3& x, double signedDistance)> normal;  ///< returns ∇Φ at x, or zero if unknown
  std::function<ClosestPoint(const Vector3& x)> closest;                   ///< set for a mesh only
  TriangleMesh mesh;
  std::optional<MeshReport> report;  ///< set for a mesh only
  bool fieldIsMadeFromIt = false;
};

/// Says why a field of some expressions cannot be compared with them.
constexpr std::string_view kNeedsTriangles =
    "a field is measured at triangles, which only Boolean expressions of closed meshes have; "
    "'hpsdf combine' prints the errors of all fields that it builds";

/// Returns true if a field with the source `source` was made from the surface `candidate`. Meshes and expressions are
/// known by their fingerprints, analytic shapes by their names.
bool isMadeFrom(const Source& candidate, const Source& source);

/// Loads a mesh file, a shape or a Boolean expression of closed meshes and converts it to the units of a field that was
/// made from `source`. Throws `Error` naming `surface`.
ReferenceSurface referenceSurface(const Console& console, const std::string& surface, const Source& source);

/// Returns the distance of a mesh file, a shape or an expression, in the units of a field that was made from `source`.
/// Warns if the field was made from another surface. Throws `Error` naming `surface`.
std::shared_ptr<const DistanceFunction> exactDistance(const Console& console, const std::string& surface,
                                                      const Source& source);

/// A mesh and the exact distance to it.
struct MeshDistance {
  TriangleMesh mesh;
  std::shared_ptr<const ExactDistance> distance;
};

/// Loads a mesh file or a built-in shape and sets up its exact distance: in the units and with the inside test of a
/// field that was made from `source`, or in its own units with the options. Warns if the field was made from another
/// surface. Throws `Error` naming `surface`, also for an analytic shape.
MeshDistance meshDistance(const Console& console, const std::string& surface, const std::optional<Source>& source,
                          const DistanceOptions& options = {});

/// Returns the defects of a mesh file or a built-in shape, in the units of a field that was made from
/// `source`. Warns if the field was made from another surface. Throws `Error` naming `surface`.
MeshDefects meshDefects(const Console& console, const std::string& surface, const Source& source);

}  // namespace hpsdf::app
