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

/// A distance with all that a construction needs.
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
  std::shared_ptr<const DistanceFunction> exact;  ///< the distance that it was made from
  std::optional<MeshReport> mesh;                 ///< nothing for an analytic shape
  double seconds = 0;                             ///< of the construction, with its distance
};

/// Makes the input and constructs the field, with progress and warnings on the console's `err`. With a file for the
/// state (`checkpointParameters` among the arguments) it continues from what is there. Throws `Error` naming `surface`,
/// `Cancelled` after Ctrl-C.
BuiltField buildField(const Console& console, const std::string& surface, const Arguments& arguments,
                      const std::filesystem::path& checkpoint = {});

/// The file in which the construction of the file `output` keeps its state.
std::filesystem::path checkpointOf(const std::filesystem::path& output);

/// Warns that bounds do not hold beside a mesh's holes, if it has some.
void warnOfBounds(const Console& console, const std::optional<MeshReport>& mesh);

}  // namespace hpsdf::app
