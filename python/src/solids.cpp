#include "solids.h"

#include <array>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "convert/arrays.h"
#include "convert/callable.h"
#include "convert/waiting.h"
#include "exact_distance.h"
#include "hpsdf/app/interpreter.h"
#include "hpsdf/combine/combined_distance.h"
#include "hpsdf/combine/expression.h"
#include "hpsdf/field.h"
#include "mesh.h"

namespace py = pybind11;
using namespace py::literals;

namespace hpsdf::python {
namespace {

constexpr std::size_t kPoints = 1 << 16;  // points between two looks for signals

/// The words for places where a distance is exact, in the order of `Exactness`.
constexpr std::array kExactnessWords = {"everywhere", "outside", "inside", "nowhere"};

/// Returns an object of Python as an operand of an expression.
Expression operandFrom(const std::string& name, const py::object& object) {
  if (py::isinstance<Field>(object)) return object.cast<const Field&>();
  if (py::isinstance<ExactDistance>(object)) {
    const auto exact = object.cast<std::shared_ptr<const ExactDistance>>();
    return DistanceFunction(exact);
  }
  if (py::isinstance<CombinedDistance>(object))
    return DistanceFunction(CombinedDistance(object.cast<const CombinedDistance&>()));
  if (isMesh(object)) return TriangleMesh(*meshOf(object));
  if (PyCallable_Check(object.ptr()) != 0) return distanceOfCallable(object);
  throw py::type_error(name + ": expected a mesh, a field, a distance or a callable, got '" +
                       std::string(py::str(py::type::of(object).attr("__name__"))) + "'");
}

std::shared_ptr<CombinedDistance> combined(const std::string& text, const std::string& insideTest, int threads,
                                           const py::object& progress, const py::kwargs& operands) {
  const DistanceOptions options = distanceOptions(insideTest, 0, threads);
  const Expression named = parseExpression(text);
  std::set<std::string> used;
  const Expression whole = withOperands(named, [&](const std::string& name) -> Expression {
    if (operands.contains(name)) {
      used.insert(name);
      return operandFrom(name, operands[name.c_str()]);
    }
    return resultOf(progress, [&](const Progress& link) { return app::loadedOperand(name, options.insideTest, link); });
  });
  for (const auto& [name, operand] : operands)
    if (!used.contains(name.cast<std::string>()))
      throw py::type_error("combine() was given '" + name.cast<std::string>() +
                           "', which the expression does not name");
  return std::make_shared<CombinedDistance>(
      resultOf(progress, [&](const Progress& link) { return CombinedDistance(whole, options, link); }));
}

py::object combinedDistances(const CombinedDistance& distance, const py::object& argument, const py::object& out) {
  return numberForEach(argument, out, [&](std::span<const Vector3> points, std::span<double> numbers) {
    forEachPiece(points.size(), kPoints, [&](std::size_t first, std::size_t count) {
      distance(points.subspan(first, count), numbers.subspan(first, count));
    });
  });
}

py::object boundaryOf(const CombinedDistance& distance) {
  if (distance.boundary() == nullptr) return py::none();
  return py::cast(std::make_shared<TriangleMesh>(*distance.boundary()));
}

std::string operationsHelp() {
  std::string text;
  for (const OperationDescription& row : operations())
    text += "\n" + std::string(row.form) + "\n    " + std::string(row.help) + "\n";
  return text;
}

}  // namespace

void addSolids(py::module_& module) {
  py::class_<CombinedDistance, std::shared_ptr<CombinedDistance>>(
      module, "CombinedDistance",
      "The signed distance of an expression of solids, which `combine` makes and of which `build` makes a field.\n\n"
      "Several threads may use one at the same time.")
      .def("__call__", &combinedDistances, "points"_a, "out"_a = py::none(),
           "Returns the signed distances of points, shape (..., 3), as an array of shape (...), or as a float for one "
           "point of shape (3,). out: as of ExactDistance.")
      .def_property_readonly(
          "exactness",
          [](const CombinedDistance& distance) {
            return kExactnessWords[static_cast<std::size_t>(distance.exactness())];
          },
          "The side of the surface on which values are exact distances: 'everywhere', 'outside', 'inside' or "
          "'nowhere'. On the other side, no value is farther from 0 than the surface is.")
      .def_property_readonly("boundary", &boundaryOf,
                             "The triangles that bound the result, for Boolean expressions of closed meshes, or None. "
                             "Triangles that were cut do not share their vertices.");
  const std::string doc =
      "Returns the distance of an expression of solids, a CombinedDistance.\n\n"
      "expression: such as 'difference(offset(a, 0.02), move(b, 0, 0, 1))'. A, B, ... below stand for solids: names "
      "that "
      "are given as keywords, names of files or shapes, or expressions. operands, by keyword: a TriangleMesh or an "
      "object with .vertices and .faces, a Field, an ExactDistance, a CombinedDistance, or a callable as of build. "
      "inside_test, for meshes: as of ExactDistance. Lengths are in the units of the solids.\n\n"
      "Raises OptionError (a ValueError) with the column of a mistake in the expression, MeshError and FileError.\n\n"
      "The operations:\n" +
      operationsHelp();
  module.def("combine", &combined, "expression"_a, py::pos_only(), py::kw_only(), "inside_test"_a = "automatic",
             "threads"_a = 0, "progress"_a = py::none(), doc.c_str());
}

}  // namespace hpsdf::python
