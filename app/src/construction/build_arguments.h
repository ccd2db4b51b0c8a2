#pragma once
// The command parameters for the construction of a field, and their conversion into options of the construction.

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

/// Returns the parameters that choose whether and how often the state of a running construction is saved.
std::vector<Parameter> checkpointParameters();

/// Returns the names of the parameters that set a stopping criterion of one of the kinds `endings`.
std::vector<std::string> endParameters(std::initializer_list<BuildSetting::Ending> endings);

/// Returns the command parameter for the setting `name` of the table `buildSettings`. `settingKind` returns only the
/// values that this parameter accepts.
Parameter settingParameter(const char* name);
ParameterKind settingKind(const char* name);

/// Returns the parameter for the number of threads. Its help text says that the result is the same for any number of
/// threads, in a sentence that begins with `result`, such as "The field is".
Parameter threadsParameter(const std::string& result);

/// Returns the parameter for the number of random points. `seedParameter` returns the one for the seed of their random
/// number generator.
Parameter pointsParameter(std::string help, std::string count, double minimum);
Parameter seedParameter(std::string help = "Which points.");

/// Returns the settings of a construction from the arguments of `buildParameters`. Explicitly given options override
/// the preset --paper.
BuildOptions buildOptions(const Arguments& arguments);

/// Returns the options of the distance function, among them the method that tells inside from outside.
DistanceOptions distanceOptions(const Arguments& arguments);

/// Returns true if the arguments ask for the mesh to be scaled and centred.
bool wantsNormalized(const Arguments& arguments);

/// Returns the domain of the field that the arguments ask for. `surface` is the bounding box of the surface.
Box domainFrom(const Arguments& arguments, const Box& surface);

/// Throws `Error` if the arguments of `buildParameters` are inconsistent, so that no field could be built
/// from any surface.
void requireConsistent(const Arguments& arguments);

/// Throws `Error` if the option `name` is given without the option `owner`, without which it has no effect.
void requireOwner(const Arguments& arguments, const char* name, const char* owner, bool ownerIsGiven);

/// Tells whether the resulting field depends on this parameter of `buildParameters`.
bool decides(const Parameter& parameter);

/// Returns all arguments on which the resulting field depends, one per line.
std::string decidingArguments(const Arguments& arguments);

}  // namespace hpsdf::app
