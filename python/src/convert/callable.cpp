#include "convert/callable.h"

#include <algorithm>
#include <memory>
#include <span>
#include <utility>

#include "convert/arrays.h"

namespace py = pybind11;

namespace hpsdf::python {
namespace {

/// Holds an object of Python, which any thread may release.
std::shared_ptr<const py::object> sharedObject(py::object object) {
  return {new py::object(std::move(object)), [](const py::object* held) {
            const py::gil_scoped_acquire lock;
            delete held;
          }};
}

struct CallableDistance {
  std::shared_ptr<const py::object> callable;

  void operator()(std::span<const Vector3> points, std::span<double> out) const {
    const py::gil_scoped_acquire held;
    const auto count = static_cast<py::ssize_t>(points.size());
    const Doubles copied({count, py::ssize_t{3}}, reinterpret_cast<const double*>(points.data()));
    const Doubles values = numbersOf((*callable)(copied), "the result of the callable");
    if (values.ndim() != 1 || values.size() != count)
      throw py::value_error("the result of the callable: expected an array of shape " + shapeText({count}) +
                            " for points of shape " + shapeText({count, 3}) + ", got " +
                            shapeText({values.shape(), values.shape() + values.ndim()}));
    std::copy_n(values.data(), points.size(), out.data());
  }
};

}  // namespace

DistanceFunction distanceOfCallable(const py::object& callable) { return CallableDistance{sharedObject(callable)}; }

}  // namespace hpsdf::python
