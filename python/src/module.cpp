// The extension hpsdf._hpsdf, from which the package hpsdf takes all its names.
#include <pybind11/pybind11.h>

#include "build.h"
#include "contour.h"
#include "convert/errors.h"
#include "exact_distance.h"
#include "field.h"
#include "jumps.h"
#include "mesh.h"
#include "samples.h"
#include "session.h"
#include "solids.h"

PYBIND11_MODULE(_hpsdf, module) {
  using namespace hpsdf::python;
  module.attr("__version__") = HPSDF_VERSION;
  addErrors(module);
  addMesh(module);
  addExactDistance(module);
  FieldClass fields = addField(module);
  addContour(fields);
  addBuild(module);
  addJumps(module);
  addSamples(module);
  addSolids(module);
  addSession(module);
}
