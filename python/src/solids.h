#pragma once

#include <pybind11/pybind11.h>

namespace hpsdf::python {

void addSolids(pybind11::module_& module);

}  // namespace hpsdf::python
