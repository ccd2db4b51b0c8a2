#pragma once
// Studies: commands that build fields of several meshes and write tables and pictures of the fields into a
// folder.

#include <cstddef>
#include <string>
#include <vector>

#include "console/console.h"
#include "hpsdf/verify.h"
#include "language/registry.h"
#include "text/json.h"

namespace hpsdf::app {

/// Adds the command `study`.
void addStudyCommand(Registry& registry);

/// A kind of study, which users run by `hpsdf study NAME MESH…`.
struct Study {
  std::string name = {};
  std::string help = {};                   ///< description in one paragraph
  std::vector<Parameter> parameters = {};  ///< parameters besides kind, mesh and output
  void (*run)(Session&, const Arguments&) = nullptr;
};

Study convergenceStudy();
Study tableStudy();
Study continuityStudy();
Study tradeoffStudy();

/// Returns the parameters of the command `build` except those in `names`. Each returned parameter, unless it is
/// a flag, may be given once for all meshes or once for each mesh.
std::vector<Parameter> buildParametersWithout(const std::vector<std::string>& names);

/// Returns the parameters for the random points at which errors are measured: their number and the seed.
std::vector<Parameter> samplingParameters();

/// Returns random points with their exact distances. If `near` is not 0, all points lie within the distance `near` of
/// the surface.
ExactSamples exactSamples(const Console& console, const Arguments& arguments, const DistanceFunction& exact,
                          const Box& domain, int threads, double near = 0);

/// Returns the arguments of `build` for the mesh with this index. A parameter that is given once for each mesh
/// takes the value with the same index. `more` are options of `build` that the study sets itself, such as
/// "--target-error=1e-6". Throws `Error` for a parameter that is given neither once nor once for each mesh.
Arguments buildArguments(const Session& session, const Arguments& arguments, std::size_t mesh,
                         const std::vector<std::string>& more = {});

/// Returns a different file name for each mesh. Throws `Error` if `buildArguments` would throw for any of the meshes,
/// so that mistakes are reported before any field is built.
std::vector<std::string> checkedNames(const Session& session, const Arguments& arguments);

/// Returns the values of a JSON object as one line of a table. Texts are quoted, because the names of shapes
/// contain commas.
std::string rowText(const Json& row, const char* separator = ",");

}  // namespace hpsdf::app
