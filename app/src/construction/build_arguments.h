#pragma once
// The options of a construction: the parameters that commands take for it, and the values of these parameters
// in the arguments of a call.

#include <initializer_list>
#include <string>
#include <vector>

#include "hpsdf/build_options.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/exact_distance.h"
#include "language/registry.h"

namespace hpsdf::app {

/// Returns the parameters of a construction, which `build`, `report` and other commands share. Parameters
/// that are settings of `BuildOptions` come from the table `buildSettings`.
std::vector<Parameter> buildParameters();

/// Returns the parameters that tell whether the state of a running construction is saved, and how often.
std::vector<Parameter> checkpointParameters();

/// Returns the names of the parameters that end a construction in one of the ways `endings`.
std::vector<std::string> endParameters(std::initializer_list<BuildSetting::Ending> endings);

/// Returns the parameter for the setting `name` of the table `buildSettings`, or only the values that it
/// accepts.
Parameter settingParameter(const char* name);
ParameterKind settingKind(const char* name);

/// Returns the parameter for the number of threads. Its help text says that the result does not depend on the
/// number of threads. The sentence begins with `result`, such as "The field is".
Parameter threadsParameter(const std::string& result);

/// Returns the parameter for the number of random points, or for the seed that selects the points.
Parameter pointsParameter(std::string help, std::string count, double minimum);
Parameter seedParameter(std::string help = "Which points.");

/// Returns the settings of a construction from the arguments of `buildParameters`. Options that the caller
/// wrote override those of --paper.
BuildOptions buildOptions(const Arguments& arguments);

/// Returns the options of the distance function, with the inside test that the arguments ask for.
DistanceOptions distanceOptions(const Arguments& arguments);

/// Returns true if the arguments ask for the mesh to be scaled and centred.
bool wantsNormalized(const Arguments& arguments);

/// Returns the domain of the field that the arguments ask for. `surface` is the bounding box of the surface.
Box domainFrom(const Arguments& arguments, const Box& surface);

/// Throws `Error` if the arguments of `buildParameters` are inconsistent, so that no field could be built
/// from any surface.
void requireConsistent(const Arguments& arguments);

/// Throws `Error` if the option `name` is given without the option `owner`. Without `owner`, the option
/// `name` has no effect.
void requireOwner(const Arguments& arguments, const char* name, const char* owner, bool ownerIsGiven);

/// Tells whether the resulting field depends on this parameter of `buildParameters`.
bool decides(const Parameter& parameter);

/// Returns all arguments on which the resulting field depends, one per line.
std::string decidingArguments(const Arguments& arguments);

}  // namespace hpsdf::app
