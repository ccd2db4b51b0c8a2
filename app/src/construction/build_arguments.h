#pragma once
// The command parameters for the construction of a field, and their conversion into options of the construction.

#include <initializer_list>
#include <new>
#include <string>
#include <vector>

#include "construction/grid_surface.h"
#include "hpsdf/build_options.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "language/registry.h"

namespace hpsdf::app {

/// Returns the parameters of a construction, which `build`, `report` and other commands share. Parameters
/// that are settings of `BuildOptions` come from the table `buildSettings`.
std::vector<Parameter> buildParameters();

/// Returns the parameters that choose whether and how often a running construction saves a checkpoint.
std::vector<Parameter> checkpointParameters();

/// Returns the parameter that names the folder for the parts of a mesh that need not fit into memory.
Parameter outOfCoreParameter();

/// Returns the names of the parameters that set a stopping criterion of one of the kinds `endings`.
std::vector<std::string> endParameters(std::initializer_list<BuildSetting::Ending> endings);
/// Returns these names, and those of the parameters that have an effect only with one of them.
std::vector<std::string> endParametersAndTheirs(std::initializer_list<BuildSetting::Ending> endings);

/// Returns the command parameter for the setting `name` of the table `buildSettings`. The function `settingKind`
/// returns only the type, the accepted values and the default of this parameter.
Parameter settingParameter(const char* name);

/// Returns the value of the parameter `strategy`.
Strategy strategyOf(const Arguments& arguments);
ParameterKind settingKind(const char* name);

/// Returns the parameter for the number of threads. `result` begins a sentence of its help text: "The field is" gives
/// "The field is the same whatever their number."
Parameter threadsParameter(const std::string& result);

/// Returns the parameter for the number of random points; `count` is its default. The function `seedParameter` returns
/// the parameter for the seed of the random number generator.
Parameter pointsParameter(std::string help, std::string count, double minimum);
Parameter seedParameter(std::string help = "Which points.");

/// Converts the arguments of `buildParameters` into the options of a construction. Explicitly given arguments override
/// the preset --paper. Lengths that are given as a percentage refer to `longestSide`, the longest side of the surface's
/// box in world units.
BuildOptions buildOptions(const Arguments& arguments, double longestSide);

/// Returns the parameters that tell inside from outside. `insideOptions` reads them and the parameter `threads`.
std::vector<Parameter> insideParameters();
DistanceOptions insideOptions(const Arguments& arguments);

/// Returns the options of a construction's distance function, among them the method that tells inside from outside.
DistanceOptions distanceOptions(const Arguments& arguments);

/// Returns where the points of a grid lie, as far as the arguments tell it.
GridPlacement gridPlacement(const Arguments& arguments);

/// Returns true if the arguments ask for the mesh to be scaled and centred.
bool wantsNormalized(const Arguments& arguments);

/// Returns the field's domain, as the arguments specify it. `surface` is the bounding box of the surface.
Box domainFrom(const Arguments& arguments, const Box& surface);

/// Throws `Error` if the arguments of `buildParameters` are invalid or contradict each other. The check does not depend
/// on the surface.
void requireConsistent(const Arguments& arguments);

/// Returns the name of a setting that is given and has no effect on a construction within a tolerance, or "".
std::string givenWithoutEffectWithinTolerance(const Arguments& arguments);

/// Returns the error of a construction that needs more memory, with the option of the command line that allows more.
Error namingMemoryLimit(const MemoryLimitError& error, const Arguments& arguments);

/// Returns the error of a construction for which the system has not enough memory. A memory limit would not help.
Error constructionOutOfMemory();

/// Calls work() and returns its result. If work() needs more memory than it may take, the error names the option that
/// allows more. If the system has too little memory, the error says how a construction needs less.
template <typename Work>
auto withinMemory(const Arguments& arguments, const Work& work) {
  try {
    return work();
  } catch (const MemoryLimitError& error) {
    throw namingMemoryLimit(error, arguments);
  } catch (const std::bad_alloc&) {
    throw constructionOutOfMemory();
  }
}

/// Throws `Error` if the option `name` is given but the option `owner` is not. Without `owner`, `name` has no effect.
void requireOwner(const Arguments& arguments, const char* name, const char* owner, bool ownerIsGiven);

/// Tells whether the resulting field depends on this parameter of `buildParameters`.
bool decides(const Parameter& parameter);

/// Returns all arguments on which the resulting field depends, one per line.
std::string decidingArguments(const Arguments& arguments);

/// Returns the command line 'hpsdf build …' that builds the field of `surface` with the arguments that are given, and
/// writes it to `file`.
std::string buildCommandLine(const std::string& surface, const std::string& file, const Arguments& arguments);

}  // namespace hpsdf::app
