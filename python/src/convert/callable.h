#pragma once

#include <pybind11/pybind11.h>

#include "hpsdf/distance_function.h"

namespace hpsdf::python {

/// Returns a callable of Python as a distance: it maps points, shape (n, 3), to signed distances, shape (n,). Any
/// thread may evaluate and destroy the distance; only one at a time runs Python. Exceptions of the callable are passed
/// on.
DistanceFunction distanceOfCallable(const pybind11::object& callable);

}  // namespace hpsdf::python
