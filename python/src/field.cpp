#include "field.h"

#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "convert/arrays.h"
#include "convert/waiting.h"
#include "hpsdf/field_file.h"

namespace py = pybind11;
using namespace py::literals;

namespace hpsdf::python {
namespace {

constexpr std::size_t kValues = 1 << 20;      // points between two looks for signals: some tenths of a second
constexpr std::size_t kPieceBytes = 4 << 20;  // bytes of the values with derivatives that are held at a time

/// A row of the array that `Field.cells` returns.
struct CellRow {
  double box[2][3];
  std::int32_t degree;
  std::int32_t depth;
  double error;
};

py::object values(const Field& field, const py::object& argument, const py::object& out) {
  return numberForEach(argument, out, [&](std::span<const Vector3> points, std::span<double> numbers) {
    if (points.size() == 1)
      numbers[0] = field.value(points[0]);  // handing over the GIL would take longer
    else
      forEachPiece(points.size(), kValues, [&](std::size_t first, std::size_t count) {
        field.values(points.subspan(first, count), numbers.subspan(first, count));
      });
  });
}

/// The shapes of the parts of a result at one point: the value, its gradient and its Hessian.
const std::array<Shape, 3> kPartShapes = {Shape{}, Shape{3}, Shape{3, 3}};

void evaluate(const Field& field, std::span<const Vector3> points, std::span<ValueAndGradient> out) {
  field.valuesAndGradients(points, out);
}
void evaluate(const Field& field, std::span<const Vector3> points, std::span<ValueGradientHessian> out) {
  field.valuesGradientsHessians(points, out);
}

/// Copies the parts of the result at point i to arrays.
void copyParts(const ValueAndGradient& result, std::size_t i, std::span<double* const> arrays) {
  arrays[0][i] = result.value;
  Eigen::Map<Vector3>(arrays[1] + 3 * i) = result.gradient;
}
void copyParts(const ValueGradientHessian& result, std::size_t i, std::span<double* const> arrays) {
  copyParts(ValueAndGradient{result.value, result.gradient}, i, arrays);
  Eigen::Map<Eigen::Matrix3d>(arrays[2] + 9 * i) = result.hessian;  // symmetric, so that rows are columns
}

/// Returns an array for each of the first `parts` parts of results: those of the tuple `out`, or new ones if it is
/// None. `expected` tells a caller which ones the tuple should have.
std::vector<Doubles> partArrays(const py::object& out, std::size_t parts, const char* expected, const Points& points) {
  if (!out.is_none() && (!py::isinstance<py::sequence>(out) || py::isinstance<py::array>(out) || py::len(out) != parts))
    throw py::type_error(std::string("out: expected ") + expected);
  std::vector<Doubles> arrays;
  for (std::size_t part = 0; part < parts; ++part) {
    const py::object given = out.is_none() ? py::none() : py::object(py::reinterpret_borrow<py::sequence>(out)[part]);
    arrays.push_back(
        resultArray(given, points.shape(kPartShapes[part]), ("out[" + std::to_string(part) + "]").c_str()));
  }
  return arrays;
}

/// Evaluates a field with derivatives. Returns a tuple of the arrays that `partArrays` describes.
template <typename Result>
py::tuple withDerivatives(const Field& field, const py::object& argument, const py::object& out, std::size_t parts,
                          const char* expected) {
  Points points(argument);
  std::vector<Doubles> arrays = partArrays(out, parts, expected, points);
  for (const Doubles& array : arrays) points.keepApartFrom(array);
  std::vector<double*> numbers;
  for (Doubles& array : arrays) numbers.push_back(array.mutable_data());
  constexpr std::size_t kAtOnce = kPieceBytes / sizeof(Result);
  std::vector<Result> piece(std::min(kAtOnce, points.count()));
  forEachPiece(points.count(), kAtOnce, [&](std::size_t first, std::size_t count) {
    evaluate(field, points.all().subspan(first, count), std::span(piece).first(count));
    for (std::size_t i = 0; i < count; ++i) copyParts(piece[i], first + i, numbers);
  });
  py::tuple result(parts);
  for (std::size_t part = 0; part < parts; ++part) result[part] = arrays[part];
  if (out.is_none()) result[0] = unwrapped(arrays[0]);
  return result;
}

py::tuple valuesAndGradients(const Field& field, const py::object& points, const py::object& out) {
  return withDerivatives<ValueAndGradient>(field, points, out, 2,
                                           "two arrays, one for the values and one for the gradients");
}

py::tuple valuesGradientsHessians(const Field& field, const py::object& points, const py::object& out) {
  return withDerivatives<ValueGradientHessian>(field, points, out, 3,
                                               "three arrays, one each for the values, the gradients and the Hessians");
}

py::array cells(const Field& field) {
  std::vector<CellRow> rows;
  field.forEachCell([&](const Cell& cell) {
    const Vector3 low = cell.box.min(), high = cell.box.max();
    rows.push_back(
        {{{low.x(), low.y(), low.z()}, {high.x(), high.y(), high.z()}}, cell.degree, cell.depth, cell.error});
  });
  return py::array_t<CellRow>(static_cast<py::ssize_t>(rows.size()), rows.data());
}

py::array domain(const Field& field) {
  Doubles corners({2, 3});
  for (int axis = 0; axis < 3; ++axis) {
    corners.mutable_at(0, axis) = field.domain().min()[axis];
    corners.mutable_at(1, axis) = field.domain().max()[axis];
  }
  return corners;
}

/// Returns a read-only array that refers to the memory of `owner`.
template <typename Number>
py::array viewOf(std::span<const Number> numbers, const py::object& owner) {
  py::array_t<Number> view(static_cast<py::ssize_t>(numbers.size()), numbers.data(), owner);
  view.attr("flags").attr("writeable") = false;
  return view;
}

py::array nodes(const py::object& self) { return viewOf(std::span(self.cast<const Field&>().data().nodes), self); }

py::array coefficients(const py::object& self) {
  const auto& stored = self.cast<const Field&>().data().coefficients;
  if (const auto* doubles = std::get_if<FieldArray<double>>(&stored)) return viewOf(doubles->all(), self);
  if (const auto* floats = std::get_if<FieldArray<float>>(&stored)) return viewOf(floats->all(), self);
  return viewOf(std::get<QuantizedCoefficients>(stored).bytes.all(), self);
}

std::string description(const Field& field) {
  return "<hpsdf.Field: " + std::to_string(statistics(field).leaves) + " cells, " + precisionName(field) + ", " +
         std::to_string(field.bytes()) + " bytes>";
}

void saved(const Field& field, const std::filesystem::path& path, bool compress) {
  const py::gil_scoped_release released;
  save(field, path, {.compress = compress});
}

std::shared_ptr<Field> loadedField(const std::filesystem::path& path, bool mapped) {
  const Loading loading = mapped ? Loading::mapped : Loading::resident;
  return std::make_shared<Field>(resultOf(py::none(), [&](const Progress&) { return load(path, loading); }));
}

}  // namespace

FieldClass addField(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(CellRow, box, degree, depth, error);
  FieldClass fields(
      module, "Field",
      "A signed distance field: an octree of polynomials, negative inside. `build` makes one, `load` reads one.\n\n"
      "Fields are immutable; several threads may use one at the same time. Outside the domain the value is an upper "
      "bound of the distance.");
  fields
      .def("__call__", &values, "points"_a, "out"_a = py::none(),
           "Returns the values at points, shape (..., 3), as an array of shape (...), or as a float for one point of "
           "shape (3,). Points and values have the units of the mesh.\n\n"
           "points: float64 and C-contiguous without a copy; other real numbers are converted. out: a C-contiguous "
           "array of float64 with the shape of the result, which receives and becomes it. Raises ValueError for other "
           "shapes and TypeError for other types.")
      .def("value_and_gradient", &valuesAndGradients, "points"_a, "out"_a = py::none(),
           "Returns the values at points, shape (..., 3), and their gradients: two arrays of the shapes (...) and "
           "(..., 3). out: two arrays for them, as of `__call__`.")
      .def(
          "value_gradient_hessian", &valuesGradientsHessians, "points"_a, "out"_a = py::none(),
          "Returns the values at points, shape (..., 3), their gradients and their Hessians, the symmetric matrices of "
          "second derivatives: three arrays of the shapes (...), (..., 3) and (..., 3, 3). Values and gradients are "
          "those of value_and_gradient. At faces of cells and wherever else the second derivatives jump, the Hessian "
          "is "
          "that of one side. out: three arrays for them, as of `__call__`.")
      .def("save", &saved, "path"_a, py::kw_only(), "compress"_a = false,
           "Writes the field as a .hpsdf file, whole or not at all; with compress=True smaller and more slowly. Raises "
           "FileError (an OSError).")
      .def(
          "cells", &cells,
          "Returns the cells as a structured array with the fields box, the lower and the upper corner; degree, 31 "
          "for cells with triangles instead of a polynomial; depth, 0 for base cells; and error, the estimated squared "
          "L2 error.")
      .def_property_readonly("nodes", &nodes,
                             "The octree's nodes, uint64: a read-only view. docs/file-format.md describes their bits.")
      .def_property_readonly("coefficients", &coefficients,
                             "The coefficients of the cells' polynomials: a read-only view of float64 or float32, in "
                             "units of length, or of uint8, the packed integers of quantized coefficients. "
                             "docs/file-format.md describes both.")
      .def_property_readonly("domain", &domain, "The lower and the upper corner of the domain: float64, shape (2, 3).")
      .def_property_readonly("nbytes", &Field::bytes,
                             "The bytes that the field takes; the coefficients of a mapped field lie in its file.")
      .def("__repr__", &description);
  module.def("load", &loadedField, "path"_a, py::kw_only(), "mapped"_a = false,
             "Reads a field from a .hpsdf file. The file is not needed afterwards. With mapped, the field stays in the "
             "file, which must be uncompressed and must not be changed (if it becomes shorter, the system ends the "
             "process): its coefficients are read and checked only "
             "where they are needed, so that it may be larger than the memory. Raises FileError (an OSError), for a "
             "mapped field also where it is used.");
  return fields;
}

}  // namespace hpsdf::python
