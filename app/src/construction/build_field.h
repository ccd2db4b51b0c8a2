#pragma once
// Builds a field from a surface and the arguments of a command.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "console/console.h"
#include "construction/build_arguments.h"
#include "hpsdf/build.h"
#include "hpsdf/mesh_report.h"

namespace hpsdf::app {

/// The inputs of a field's construction, such as the surface's distance function, the domain and the options.
struct BuildInput {
  std::shared_ptr<const DistanceFunction> exact;
  std::optional<MeshReport> mesh;  ///< empty for an analytic shape
  Box domain;
  BuildOptions options;
  double setUpSeconds = 0;  ///< time to set up the distance function
};

/// Loads a surface, warns about its flaws and sets up its exact distance function. If `partsFolder` is not empty, the
/// surface is a mesh that need not fit into memory, whose parts are in this folder (`DistanceOnDisk`). Throws `Error`
/// naming `surface`.
BuildInput buildInput(const Console& console, const std::string& surface, const Arguments& arguments,
                      const std::filesystem::path& partsFolder = {});

/// Reads an expression of solids, loads its operands, warns about a domain that cuts the surface, and sets up the
/// expression's distance function. Throws `Error` naming "expression".
BuildInput combinedInput(const Console& console, const std::string& expression, const Arguments& arguments);

/// Allows a construction the memory of the distance `exact` in addition to the default memory limit, which is meant for
/// what grows. Changes nothing if the arguments give a limit.
void allowDistance(BuildOptions& options, const DistanceFunction& exact, const Arguments& arguments);

struct BuiltField {
  Field field;
  std::shared_ptr<const DistanceFunction> exact;  ///< the exact distance that the field approximates
  std::optional<MeshReport> mesh;                 ///< empty for an analytic shape
  double seconds = 0;  ///< time to set up the distance function, to build the field and to measure it
};

/// Loads the surface, builds its field and measures it. Progress and warnings go to the console's `err`. If
/// `checkpoint` names a file, the construction saves its state in this file, and continues from a state that an earlier
/// call saved there. The arguments must then include those of `checkpointParameters`. Throws `Error` naming `surface`,
/// and `Cancelled` after Ctrl-C.
BuiltField buildField(const Console& console, const std::string& surface, const Arguments& arguments,
                      const std::filesystem::path& checkpoint = {});

/// Builds and measures the field of `input`, which `surface` names, as the function above does.
BuiltField buildField(const Console& console, BuildInput input, const std::string& surface, const Arguments& arguments,
                      const std::filesystem::path& checkpoint = {});

/// Warns of what a field that was built with these options misses: of a maximum error, a precision, or the conditions
/// of its bounds.
void warnOfField(const Console& console, const Field& field, const BuildOptions& options,
                 const std::optional<MeshReport>& mesh);

/// Returns the name of the checkpoint file in which the construction of the field file `output` saves its state.
std::filesystem::path checkpointOf(const std::filesystem::path& output);

/// If the mesh has holes, warns that error bounds do not hold near the holes.
void warnOfBounds(const Console& console, const std::optional<MeshReport>& mesh);

}  // namespace hpsdf::app
