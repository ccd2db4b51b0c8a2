#include "convert/arrays.h"

#include <functional>

namespace py = pybind11;

namespace hpsdf::python {
namespace {

static_assert(sizeof(Vector3) == 3 * sizeof(double), "an array of shape (n, 3) is an array of n vectors");

Shape shapeOf(const py::array& array) { return {array.shape(), array.shape() + array.ndim()}; }

std::string typeName(const py::handle& object) { return py::str(py::type::of(object).attr("__name__")); }

bool isRealNumbers(const py::array& array) {
  return std::string("fiu").find(array.dtype().kind()) != std::string::npos;
}

/// Returns an array for any argument, as numpy.asarray does.
py::array arrayOf(const py::handle& argument, const char* name) {
  if (py::isinstance<py::array>(argument)) return py::reinterpret_borrow<py::array>(argument);
  try {
    return py::module_::import("numpy").attr("asarray")(argument);
  } catch (py::error_already_set& error) {
    if (!error.matches(PyExc_ValueError)) throw;  // rows of different lengths are one
    throw py::value_error(std::string(name) + ": expected an array of numbers: " + error.what());
  }
}

}  // namespace

std::string shapeText(const Shape& shape) {
  std::string text;
  for (const py::ssize_t length : shape) text += (text.empty() ? "" : ", ") + std::to_string(length);
  return "(" + text + (shape.size() == 1 ? ",)" : ")");
}

Doubles numbersOf(const py::handle& argument, const char* name) {
  const py::array array = arrayOf(argument, name);
  if (!isRealNumbers(array))
    throw py::type_error(std::string(name) + ": expected an array of real numbers, got " +
                         (py::isinstance<py::array>(argument) ? "one of " + std::string(py::str(array.dtype()))
                                                              : "'" + typeName(argument) + "'"));
  Doubles numbers = Doubles::ensure(array);
  if (!numbers) throw py::error_already_set();
  return numbers;
}

Points::Points(const py::handle& argument, const char* name) : numbers_(numbersOf(argument, name)) {
  if (numbers_.ndim() == 0 || numbers_.shape(numbers_.ndim() - 1) != 3)
    throw py::value_error(std::string(name) + ": expected an array of shape (..., 3), got " +
                          shapeText(shapeOf(numbers_)));
}

std::span<const Vector3> Points::all() const { return {reinterpret_cast<const Vector3*>(numbers_.data()), count()}; }

Shape Points::shape(const Shape& each) const {
  Shape shape = shapeOf(numbers_);
  shape.pop_back();
  shape.insert(shape.end(), each.begin(), each.end());
  return shape;
}

void Points::keepApartFrom(const Doubles& out) {
  const std::less<const double*> before;
  const double *first = numbers_.data(), *firstOut = out.data();
  if (before(first, firstOut + out.size()) && before(firstOut, first + numbers_.size()))
    numbers_ = Doubles(shapeOf(numbers_), first);
}

Doubles resultArray(const py::object& out, const Shape& shape, const char* name) {
  if (out.is_none()) return Doubles(shape);
  const std::string prefix = std::string(name) + ": expected an array of float64";
  if (!py::isinstance<py::array>(out)) throw py::type_error(prefix + ", got '" + typeName(out) + "'");
  const auto array = py::reinterpret_borrow<py::array>(out);
  if (!py::dtype::of<double>().equal(array.dtype()))
    throw py::type_error(prefix + ", got one of " + std::string(py::str(array.dtype())));
  if (shapeOf(array) != shape)
    throw py::value_error(prefix + " with the shape " + shapeText(shape) + ", got " + shapeText(shapeOf(array)));
  if (!array.writeable()) throw py::value_error(prefix + " that is writeable, got a read-only one");
  const bool isAligned = (array.flags() & py::detail::npy_api::constants::NPY_ARRAY_ALIGNED_) != 0;
  if (!Doubles::check_(array) || !isAligned) throw py::value_error(prefix + " that is C-contiguous and aligned");
  return py::reinterpret_borrow<Doubles>(array);
}

py::object unwrapped(const Doubles& result) {
  if (result.ndim() > 0) return result;
  return py::float_(*result.data());
}

py::object numberForEach(const py::object& points, const py::object& out,
                         const std::function<void(std::span<const Vector3>, std::span<double>)>& fill) {
  Points given(points);
  Doubles result = resultArray(out, given.shape());
  given.keepApartFrom(result);
  fill(given.all(), {result.mutable_data(), given.count()});
  return out.is_none() ? unwrapped(result) : out;
}

py::object newNamedTuple(const char* name, const py::tuple& fields) {
  using namespace py::literals;
  return py::module_::import("collections").attr("namedtuple")(name, fields, "module"_a = "hpsdf");
}

}  // namespace hpsdf::python
