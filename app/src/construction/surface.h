#pragma once
// Makes a surface, from which a field can be built, from the name of a mesh file or a shape.

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "console/console.h"
#include "construction/grid_surface.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/mesh_report.h"

namespace hpsdf::app {

/// The prefixes of shape names: kBuiltin for shapes that are meshes, kAnalytic for shapes whose distance has a closed
/// form.
constexpr std::string_view kBuiltin = "builtin:";
constexpr std::string_view kAnalytic = "analytic:";

/// Returns true for the name of a shape, builtin:… or analytic:…, and false for the name of a file.
bool isShape(std::string_view surface);

/// Reads a mesh file, takes a mesh in memory of this name (`Console::meshes`) or makes a built-in shape. All commands
/// get their meshes from this function. The console's `meshReader` reads files that assimp or Draco take part in
/// reading. Throws `Error`, also for an analytic shape or a grid, and `Cancelled` after Ctrl-C.
ImportedMesh importSurface(const Console& console, const std::string& surface);

/// Throws `Error` if the name is that of an analytic shape or a grid, which have no mesh.
void requireMesh(const std::string& surface);

/// A surface in the units of the field: a mesh, or a distance without one.
struct PreparedSurface {
  std::optional<DistanceFunction> function;  ///< set for an analytic shape or a grid; other surfaces have a mesh
  TriangleMesh mesh;
  std::optional<MeshReport> report;  ///< report on the mesh before normalization
  Normalization normalization;
  Box samples = {};  ///< box of a grid's samples; empty if the distance is known everywhere

  Box box() const { return function ? function->source().box : boundingBox(mesh); }
};

/// Loads a surface and normalizes it if `normalizes` is true. `placement` tells where the points of a grid lie. Throws
/// `Error` if the surface cannot be loaded, and `Cancelled` after Ctrl-C.
PreparedSurface prepareSurface(const Console& console, const std::string& surface, bool normalizes,
                               const GridPlacement& placement = {});

/// Returns the distance to the surface scaled and centred so that the longest side of its box spans [-1, 1], with
/// gradients if `distance` has them. Throws `Error` if the box is empty or unknown.
DistanceFunction normalizedFunction(const DistanceFunction& distance);

/// Throws `Error` if the exact distance function of the mesh would need more memory than is available.
void requireDistanceMemory(const TriangleMesh& mesh, InsideTest insideTest = InsideTest::automatic);

/// Sets up the exact distance function of a mesh. Throws `Error`, for instance if the function does not fit in memory,
/// and `Cancelled` after Ctrl-C.
std::shared_ptr<const ExactDistance> distanceTo(const Console& console, const TriangleMesh& mesh,
                                                const DistanceOptions& options = {});

/// Returns a distance function that evaluates `exact` and records the normalization of the mesh.
std::shared_ptr<const DistanceFunction> withNormalization(const std::shared_ptr<const ExactDistance>& exact,
                                                          const Normalization& normalization);

/// Sets up the exact distance function of a prepared mesh. If the choice of the inside test is not evident, reports it.
std::shared_ptr<const ExactDistance> distanceToMesh(const Console& console, const std::string& surface,
                                                    const PreparedSurface& prepared, const DistanceOptions& options);

/// Sets up the distance function of a prepared surface. If the choice of the inside test is not evident, reports it.
std::shared_ptr<const DistanceFunction> distanceTo(const Console& console, const std::string& surface,
                                                   const PreparedSurface& prepared, const DistanceOptions& options);

/// Calls work() and returns its result. If work() throws an `Error` that names neither `surface` nor `other`, the error
/// is changed to name `surface`.
template <typename Work>
auto namingSurface(const std::string& surface, const Work& work, const std::string& other = "") {
  try {
    return work();
  } catch (const Error& error) {
    if (error.subject() == surface || (!other.empty() && error.subject() == other)) throw;
    throw Error(error.kind(), surface, error.what());
  }
}

}  // namespace hpsdf::app
