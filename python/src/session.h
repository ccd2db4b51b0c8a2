#pragma once

#include <pybind11/pybind11.h>

namespace hpsdf::python {

void addSession(pybind11::module_& module);

}  // namespace hpsdf::python
