#pragma once
// The options of a construction: the parameters by which commands take them, and their values in the arguments of
// a call.

#include <initializer_list>
#include <string>
#include <vector>

#include "hpsdf/build_options.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/exact_distance.h"
#include "language/registry.h"

namespace hpsdf::app {

/// The parameters of a construction, shared by `build`, `report` and others. Those that are settings of `BuildOptions`
/// come from the table `buildSettings`.
std::vector<Parameter> buildParameters();

/// The parameters that tell whether and how often the state of a construction is kept.
std::vector<Parameter> checkpointParameters();

/// Names of the parameters that end a construction in one of the given ways.
std::vector<std::string> endParameters(std::initializer_list<BuildSetting::Ending> endings);

/// The parameter of the table's setting `name`, or what it accepts.
Parameter settingParameter(const char* name);
ParameterKind settingKind(const char* name);

/// The number of threads. The help text says that the result does not depend on it, in a sentence that begins with
/// `result`, such as "The field is".
Parameter threadsParameter(const std::string& result);

/// The number of random points, and the seed that selects them.
Parameter pointsParameter(std::string help, std::string count, double minimum);
Parameter seedParameter(std::string help = "Which points.");

/// The settings that the arguments of `buildParameters` ask for. Options that the caller wrote override --paper.
BuildOptions buildOptions(const Arguments& arguments);

/// The inside test that the arguments ask for.
DistanceOptions distanceOptions(const Arguments& arguments);

/// Returns true if the arguments ask for the mesh to be scaled and centred.
bool wantsNormalized(const Arguments& arguments);

/// The domain that the arguments ask for around the bounding box of a surface.
Box domainFrom(const Arguments& arguments, const Box& surface);

/// Throws `Error` for arguments of `buildParameters` with which no surface could be built.
void requireConsistent(const Arguments& arguments);

/// Throws `Error` where the option `name` is given without `owner`, without which it has no effect.
void requireOwner(const Arguments& arguments, const char* name, const char* owner, bool ownerIsGiven);

/// Tells whether the field depends on a parameter of `buildParameters`.
bool decides(const Parameter& parameter);

/// All arguments on which the field depends, one per line.
std::string decidingArguments(const Arguments& arguments);

}  // namespace hpsdf::app
