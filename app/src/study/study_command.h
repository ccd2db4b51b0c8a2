#pragma once
// Studies: they build fields of several meshes and write tables and pictures about them into a folder.

#include <cstddef>
#include <string>
#include <vector>

#include "console/console.h"
#include "hpsdf/verify.h"
#include "language/registry.h"
#include "text/json.h"

namespace hpsdf::app {

/// Adds `study`.
void addStudyCommand(Registry& registry);

/// A kind of study: `hpsdf study NAME MESH…`.
struct Study {
  std::string name = {};
  std::string help = {};                   ///< one paragraph
  std::vector<Parameter> parameters = {};  ///< parameters besides kind, mesh and output
  void (*run)(Session&, const Arguments&) = nullptr;
};

Study convergenceStudy();
Study tableStudy();
Study continuityStudy();

/// The parameters of `build` except those named. Each, except flags, may be given once for all meshes or once for
/// each.
std::vector<Parameter> buildParametersWithout(const std::vector<std::string>& names);

/// The parameters of the points at which errors are measured: their number and the seed of their positions.
std::vector<Parameter> samplingParameters();

/// Exact distances at such points, all within `near` of the surface unless that is 0.
ExactSamples exactSamples(const Console& console, const Arguments& arguments, const DistanceFunction& exact,
                          const Box& domain, int threads, double near = 0);

/// The arguments of `build` for the mesh of that index. A parameter that is given once for each mesh has the value
/// at the same index. Throws `Error` for a parameter that is given any other number of times.
Arguments buildArguments(const Session& session, const Arguments& arguments, std::size_t mesh);

/// A different file name for each mesh. Throws `Error` where `buildArguments` would do so for one of them, so that
/// mistakes are reported before the long work.
std::vector<std::string> checkedNames(const Session& session, const Arguments& arguments);

/// The values of an object as one line of a table. Texts stand in quotes, because the names of shapes contain commas.
std::string rowText(const Json& row, const char* separator = ",");

}  // namespace hpsdf::app
