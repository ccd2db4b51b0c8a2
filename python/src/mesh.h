#pragma once

#include <pybind11/pybind11.h>

#include <memory>

#include "hpsdf/triangle_mesh.h"

namespace hpsdf::python {

/// Tells whether an object is a mesh: a `TriangleMesh`, or an object with the attributes `vertices` and `faces`.
bool isMesh(const pybind11::handle& object);

/// Returns the mesh of such an object. Raises `TypeError` for any other object, and `MeshError` for arrays that are no
/// mesh.
std::shared_ptr<const TriangleMesh> meshOf(const pybind11::object& object);

void addMesh(pybind11::module_& module);

}  // namespace hpsdf::python
