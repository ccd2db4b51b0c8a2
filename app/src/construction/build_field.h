#pragma once
// From a surface and the arguments of a command to a field.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "console/console.h"
#include "construction/build_arguments.h"
#include "hpsdf/build.h"
#include "hpsdf/mesh_report.h"

namespace hpsdf::app {

/// A distance function with everything else that a construction needs.
struct BuildInput {
  std::shared_ptr<const DistanceFunction> exact;
  std::optional<MeshReport> mesh;  ///< nothing for an analytic shape
  Box domain;
  BuildOptions options;
  double setUpSeconds = 0;  ///< time to make the distance
};

/// Loads a surface, warns about it and makes its exact distance. Throws `Error` naming `surface`.
BuildInput buildInput(const Console& console, const std::string& surface, const Arguments& arguments);

struct BuiltField {
  Field field;
  std::shared_ptr<const DistanceFunction> exact;  ///< the distance from which the field was made
  std::optional<MeshReport> mesh;                 ///< nothing for an analytic shape
  double seconds = 0;                             ///< time of construction and distance
};

/// Makes the input and constructs the field, with progress and warnings on the console's `err`. If the file
/// `checkpoint` is given, the construction continues from the state in it, and `checkpointParameters` must be
/// among the arguments. Throws `Error` naming `surface`, and `Cancelled` after Ctrl-C.
BuiltField buildField(const Console& console, const std::string& surface, const Arguments& arguments,
                      const std::filesystem::path& checkpoint = {});

/// The file in which the construction of the field file `output` keeps its state.
std::filesystem::path checkpointOf(const std::filesystem::path& output);

/// Warns that bounds do not hold near the mesh's holes, if the mesh has holes.
void warnOfBounds(const Console& console, const std::optional<MeshReport>& mesh);

}  // namespace hpsdf::app
