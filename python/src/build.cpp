#include "hpsdf/build.h"

#include <algorithm>
#include <memory>
#include <string>

#include "build.h"
#include "convert/arrays.h"
#include "convert/callable.h"
#include "convert/settings.h"
#include "convert/waiting.h"
#include "exact_distance.h"
#include "hpsdf/combine/combined_distance.h"
#include "hpsdf/verify.h"
#include "mesh.h"

namespace py = pybind11;
using namespace py::literals;

namespace hpsdf::python {
namespace {

/// Returns the domain that `box` stands for: two corners, or 'cube' or 'box', enlarged by `margin` around a surface.
Box domainFrom(const py::object& box, double margin, const Box& surface) {
  if (py::isinstance<py::str>(box)) {
    const auto word = box.cast<std::string>();
    if (word != "cube" && word != "box")
      throw Error(ErrorKind::option, "box", "expected 'cube', 'box' or two corners, got '" + word + "'");
    if (surface.isEmpty())
      throw Error(ErrorKind::option, "box", "expected the two corners of the domain, because the surface is unknown");
    return domainAround(surface, word == "box" ? DomainShape::box : DomainShape::cube, margin);
  }
  const Points corners(box, "box");
  if (corners.shape() != Shape{2})
    throw py::value_error("box: expected two corners of three numbers, got an array of shape " +
                          shapeText(corners.shape({3})));
  return Box(corners.all()[0], corners.all()[1]);
}

double longestSideOf(const Box& surface) { return surface.isEmpty() ? 0 : surface.sizes().maxCoeff(); }

/// Builds the field of a distance and measures its errors, as the program does.
std::shared_ptr<Field> fieldOf(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                               const py::object& progress) {
  return std::make_shared<Field>(resultOf(progress, [&](const Progress& link) {
    return measured(build(distance, domain, options, link), distance, options, link);
  }));
}

std::shared_ptr<Field> builtField(const py::object& surface, const py::object& box, double margin,
                                  const std::string& insideTest, double thickness, const py::object& progress,
                                  const py::kwargs& settings) {
  const auto build = [&](const DistanceFunction& distance) {
    const Box& known = distance.source().box;
    const BuildOptions options = buildOptionsFrom(settings, longestSideOf(known));
    const Box domain = domainFrom(box, margin, known);
    checkBuild(domain, options);
    return fieldOf(distance, domain, options, progress);
  };
  if (py::isinstance<ExactDistance>(surface)) return build(surface.cast<const ExactDistance&>());
  if (py::isinstance<CombinedDistance>(surface)) return build(surface.cast<const CombinedDistance&>());
  if (isMesh(surface)) {
    const auto mesh = meshOf(surface);
    const BuildOptions options = buildOptionsFrom(settings, longestSideOf(boundingBox(*mesh)));
    const DistanceOptions inside = distanceOptions(insideTest, thickness, options.threads);
    const auto distance = resultOf(progress, [&](const Progress& link) { return ExactDistance(*mesh, inside, link); });
    return build(distance);
  }
  if (PyCallable_Check(surface.ptr()) == 0)
    throw py::type_error("surface: expected a mesh, an ExactDistance, a CombinedDistance or a callable, got '" +
                         std::string(py::str(py::type::of(surface).attr("__name__"))) + "'");
  return build(distanceOfCallable(surface));
}

}  // namespace

void addBuild(py::module_& module) {
  const std::string doc =
      "Builds the field of a mesh, of an ExactDistance or a CombinedDistance, or of a callable.\n\n"
      "surface: a TriangleMesh, an object with .vertices and .faces, an ExactDistance, a CombinedDistance, or a "
      "callable that maps points, "
      "shape (n, 3), to signed distances, shape (n,), negative inside. Any thread may call it.\n\n"
      "box: the domain: two corners, or 'cube' or 'box' around the mesh, enlarged by the margin. inside_test and "
      "thickness, of a mesh: as of ExactDistance. progress: a callable that takes the name of a task and the fraction "
      "done, or True for a bar on standard error. Ctrl-C cancels with KeyboardInterrupt.\n\n"
      "Raises OptionError and MeshError, which are ValueErrors, LimitError, which is a MemoryError, and passes on what "
      "the callables raise.\n\nThe options of the construction:\n" +
      settingsHelp();
  module.def("build", &builtField, "surface"_a, py::kw_only(), "box"_a = "cube", "margin"_a = 0.1,
             "inside_test"_a = "automatic", "thickness"_a = 0.0, "progress"_a = py::none(), doc.c_str());
}

}  // namespace hpsdf::python
