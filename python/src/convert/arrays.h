#pragma once
// Arrays of NumPy as the spans that the library takes.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf::python {

/// An array of float64, C-contiguous and aligned.
using Doubles = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast |
                                              pybind11::detail::npy_api::constants::NPY_ARRAY_ALIGNED_>;
using Shape = std::vector<pybind11::ssize_t>;

/// Returns a shape as Python writes it: "(5, 3)".
std::string shapeText(const Shape& shape);

/// Returns the numbers of an array, or of what NumPy makes an array of, such as a list. An array of float64 that is
/// C-contiguous is not copied. Raises `TypeError`, naming the argument `name`, for anything but real numbers.
Doubles numbersOf(const pybind11::handle& argument, const char* name);

/// The points of an array of shape (..., 3).
class Points {
 public:
  /// Raises `TypeError` for anything but real numbers, and `ValueError` for another shape.
  explicit Points(const pybind11::handle& argument, const char* name = "points");

  std::span<const Vector3> all() const;
  std::size_t count() const { return static_cast<std::size_t>(numbers_.size()) / 3; }

  /// Returns the shape of an array with one number for each point, or with an array of the shape `each` for each.
  Shape shape(const Shape& each = {}) const;

  /// Copies the points if `out` shares memory with them, because results would overwrite points still to be read.
  void keepApartFrom(const Doubles& out);

 private:
  Doubles numbers_;
};

/// Returns the array `out` that the caller passed, for results, or a new array if it is None. Raises `TypeError` for
/// anything but an array of float64, and `ValueError` for one of another shape, not C-contiguous or not writeable.
Doubles resultArray(const pybind11::object& out, const Shape& shape, const char* name = "out");

/// Returns a result for the caller: an array without axes as a float, any other as it is.
pybind11::object unwrapped(const Doubles& result);

/// Returns a number for each of the points, which `fill` sets: in `out` as of `resultArray`, or as of `unwrapped`.
pybind11::object numberForEach(const pybind11::object& points, const pybind11::object& out,
                               const std::function<void(std::span<const Vector3>, std::span<double>)>& fill);

/// Returns a new class of named tuples that belongs to the package.
pybind11::object newNamedTuple(const char* name, const pybind11::tuple& fields);

}  // namespace hpsdf::python
