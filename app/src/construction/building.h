#pragma once
// From a mesh file or a shape's name to a field, as `build` and `report` do it.

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "console/console.h"
#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/mesh_report.h"
#include "language/registry.h"

namespace hpsdf::app {

/// The parameters of a construction, shared by `build`, `report` and others.
std::vector<Parameter> buildParameters();

/// Whether and how often the state of a construction is kept.
std::vector<Parameter> checkpointParameters();

/// How many threads; `result`, such as "The field is", does not depend on them.
Parameter threadsParameter(const std::string& result);

/// How many random points, and which.
Parameter pointsParameter(std::string help, std::string count, double minimum);
Parameter seedParameter();

/// λ of weak continuity, for `build` and `smooth`.
Parameter continuityWeightParameter();

/// The options that such arguments ask for. --paper gives way to what is written beside it.
BuildOptions buildOptions(const Arguments& arguments);

/// Throws `Error` for arguments of `buildParameters` that no surface could be built with.
void requireConsistent(const Arguments& arguments);

/// Throws `Error`, also where it would not fit in memory, and `Cancelled` after Ctrl-C. Progress goes to the console's
/// `err`.
std::shared_ptr<const ExactDistance> distanceTo(const Console& console, const TriangleMesh& mesh,
                                                const DistanceOptions& options = {});

/// An option that says nothing without another is a mistake. `owner` names that other, `given` tells whether it is
/// there. Throws `Error`.
void requireOwner(const Arguments& arguments, const char* name, const char* owner, bool given);

/// Whether what a construction comes to depends on a parameter of `buildParameters`.
bool decides(const Parameter& parameter);

/// Everything that decides what a construction comes to, whatever an argument is for.
std::string decidingArguments(const Arguments& arguments);

/// Where a construction keeps its state that ends in the file `output`.
std::filesystem::path checkpointOf(const std::filesystem::path& output);

/// The width of blended zones.
Parameter blendWidthParameter(std::string name);

/// What a construction starts from.
struct BuildInput {
  std::shared_ptr<const DistanceFunction> exact;
  std::optional<MeshReport> mesh;  ///< nothing for an analytic shape
  Box domain;
  BuildOptions options;
  double setUpSeconds = 0;  ///< for the hierarchy over the triangles
};

/// Throws `Error` naming `surface`. Warnings go to the console's `err`.
BuildInput buildInput(const Console& console, const std::string& surface, const Arguments& arguments);

struct BuiltField {
  Field field;
  std::shared_ptr<const DistanceFunction> exact;  ///< what it was made from
  std::optional<MeshReport> mesh;                 ///< nothing for an analytic shape
  double seconds = 0;                             ///< of the construction, with the hierarchy over the triangles
};

/// Throws `Error` naming `surface`, `Cancelled` after Ctrl-C. Progress and warnings go to the console's `err`. With a
/// file for the construction's state (`checkpointParameters` among the arguments) it goes on from what is there.
BuiltField buildField(const Console& console, const std::string& surface, const Arguments& arguments,
                      const std::filesystem::path& checkpoint = {});

/// That bounds do not hold beside a mesh's holes, where it has some.
void warnOfBounds(const Console& console, const std::optional<MeshReport>& mesh);

/// Whether it names a shape rather than a file: builtin:… or analytic:…
bool isShape(std::string_view surface);

/// The exact distance of a mesh file or a shape, in the units of a field that was made from `source`. Warns when the
/// surface is another one. Throws `Error` naming `surface`.
std::shared_ptr<const DistanceFunction> exactDistance(const Console& console, const std::string& surface,
                                                      const Source& source);

/// A surface to measure a field against: its distance and, in the units of the field, its mesh; of an analytic shape
/// that of the built-in one, from which it hardly differs.
struct ReferenceSurface {
  std::shared_ptr<const DistanceFunction> distance;
  std::function<Vector3(const Vector3&, double)> normal;  ///< as `VerifiedSurface` has it
  TriangleMesh mesh;
  std::optional<MeshReport> report;  ///< nothing for an analytic shape
  bool fieldIsMadeFromIt = false;
};

/// Of a mesh file or a shape, for a field that was made from `source`. Throws `Error` naming `surface`.
ReferenceSurface referenceSurface(const Console& console, const std::string& surface, const Source& source);

/// What is wrong with the mesh `surface`, in the units of a field that was made from `source`. Throws `Error` naming
/// it.
MeshDefects meshDefects(const Console& console, const std::string& surface, const Source& source);

/// A mesh file or a built-in shape: the one road by which commands come to meshes. Files are read by the console's
/// `meshReader`; a warning goes to the console's `err` where the reader's floats lose something of them. Throws
/// `Error`, also for an analytic shape, and `Cancelled` after Ctrl-C.
ImportedMesh importSurface(const Console& console, const std::string& surface);

}  // namespace hpsdf::app
