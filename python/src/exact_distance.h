#pragma once

#include <pybind11/pybind11.h>

#include <string>

#include "hpsdf/exact_distance.h"

namespace hpsdf::python {

/// Returns the options of a distance. Throws `Error` for an inside test that does not exist.
DistanceOptions distanceOptions(const std::string& insideTest, double thickness, int threads);

void addExactDistance(pybind11::module_& module);

}  // namespace hpsdf::python
