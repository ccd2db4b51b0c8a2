#pragma once

#include <pybind11/pybind11.h>

#include <string>

#include "hpsdf/build_options.h"

namespace hpsdf::python {

/// Returns the options of a construction from keyword arguments, whose names are those of the settings with underscores
/// (`buildSettings`), by the rules of `GivenSettings`. An argument that is None counts as not given. Strings are values
/// as the program takes them; percentages, such as "0.02%", refer to `longestSide`, the longest side of the mesh in its
/// units.
///
/// Raises `TypeError` for an unknown name or a value of another type, and throws `Error` of the kind `option` for a
/// value out of range and for settings that exclude each other.
BuildOptions buildOptionsFrom(const pybind11::kwargs& arguments, double longestSide);

/// Returns the settings for a docstring, one paragraph for each: its name, values, default and help.
std::string settingsHelp();

}  // namespace hpsdf::python
