#pragma once

#include <pybind11/pybind11.h>

namespace hpsdf::python {

/// Adds the exception classes to the module, and has errors of the library raised as objects of them.
void addErrors(pybind11::module_& module);

}  // namespace hpsdf::python
