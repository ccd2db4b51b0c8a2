#pragma once
// From the name of a mesh file or a shape to a surface of which a field can be made.

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "console/console.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/mesh_report.h"

namespace hpsdf::app {

/// The beginnings of the names of shapes: kBuiltin for shapes as meshes, kAnalytic for shapes in closed form.
constexpr std::string_view kBuiltin = "builtin:";
constexpr std::string_view kAnalytic = "analytic:";

/// Returns true for the name of a shape, builtin:… or analytic:…, and false for the name of a file.
bool isShape(std::string_view surface);

/// Reads a mesh file or makes a built-in shape; all commands obtain their meshes by this function. Files are read
/// by the console's `meshReader`. Warns where coordinates lose digits because the reader keeps them as float.
/// Throws `Error`, also for an analytic shape, and `Cancelled` after Ctrl-C.
ImportedMesh importSurface(const Console& console, const std::string& surface);

/// A surface in the units of the field: a mesh, or a distance in closed form.
struct PreparedSurface {
  std::optional<DistanceFunction> analytic;  ///< only for an analytic shape; others have a mesh
  TriangleMesh mesh;
  std::optional<MeshReport> report;  ///< of the mesh before normalization
  Normalization normalization;

  Box box() const { return analytic ? analytic->source().box : boundingBox(mesh); }
};

/// Loads a surface and, if asked, normalizes it. Throws `Error`, and `Cancelled` after Ctrl-C.
PreparedSurface prepareSurface(const Console& console, const std::string& surface, bool normalizes);

/// Throws `Error` where the exact distance of the mesh does not fit in memory.
void requireDistanceMemory(const TriangleMesh& mesh, InsideTest insideTest = InsideTest::automatic);

/// The exact distance of a mesh. Throws `Error`, also where it does not fit in memory, and `Cancelled` after Ctrl-C.
std::shared_ptr<const ExactDistance> distanceTo(const Console& console, const TriangleMesh& mesh,
                                                const DistanceOptions& options = {});

/// A distance function that evaluates `exact`, with the normalization of the mesh recorded in its source.
std::shared_ptr<const DistanceFunction> withNormalization(const std::shared_ptr<const ExactDistance>& exact,
                                                          const Normalization& normalization);

/// The distance of a prepared surface. Reports how inside is told from outside where that is not evident.
std::shared_ptr<const DistanceFunction> distanceTo(const Console& console, const std::string& surface,
                                                   const PreparedSurface& prepared, const DistanceOptions& options);

/// Returns work(). The `Error`s that it throws get the surface as their subject, but those about `other` keep it.
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
