#pragma once
// Studies: what fields of several meshes have in common, as tables and pictures in a folder.

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "hpsdf/verify.h"
#include "language/registry.h"

namespace hpsdf::app {

/// A kind of study: `hpsdf study NAME MESH…`.
struct Study {
  std::string name = {};
  std::string help = {};                   ///< a paragraph
  std::vector<Parameter> parameters = {};  ///< besides kind, mesh and output
  void (*run)(Session&, const Arguments&) = nullptr;
};

Study convergenceStudy();
Study tableStudy();
Study continuityStudy();

/// Parameters of `build` that a study takes too, once for all meshes or once for each: all but these.
std::vector<Parameter> buildParametersWithout(const std::vector<std::string>& names);

/// How many points errors are measured at, and which.
std::vector<Parameter> samplingParameters();
SampleOptions sampleOptions(const Arguments& arguments, int threads);

/// For one of the meshes, the arguments of `build` that are among a study's: of an option that is given once for each
/// mesh the one of its place. Throws `Error` for one that is given another number of times.
Arguments buildArguments(const Session& session, const Arguments& arguments, std::size_t mesh);

/// Plain names for files, one for each mesh, no two the same.
std::vector<std::string> fileNames(const std::vector<std::string>& meshes);

}  // namespace hpsdf::app
