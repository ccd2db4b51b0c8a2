#include "hpsdf/jumps.h"

#include <algorithm>
#include <vector>

#include "convert/arrays.h"
#include "convert/waiting.h"
#include "hpsdf/field.h"
#include "jumps.h"

namespace py = pybind11;
using namespace py::literals;

namespace hpsdf::python {
namespace {

/// A row of the array that `jumps` returns.
struct JumpRow {
  std::int32_t degrees[2];
  std::int32_t depths[2];
  std::int32_t axis;
  double rms;
  double max;
  double gradient_rms;  // NOLINT(readability-identifier-naming): the names of Python's columns
  double gradient_max;  // NOLINT(readability-identifier-naming)
  double area;
  double center[3];
  double worst[3];
};

JumpRow rowOf(const Interface& face) {
  return {.degrees = {face.degrees[0], face.degrees[1]},
          .depths = {face.depths[0], face.depths[1]},
          .axis = face.axis,
          .rms = face.value.rms,
          .max = face.value.max,
          .gradient_rms = face.gradient.rms,
          .gradient_max = face.gradient.max,
          .area = face.area,
          .center = {face.center.x(), face.center.y(), face.center.z()},
          .worst = {face.worst.x(), face.worst.y(), face.worst.z()}};
}

py::array jumps(const Field& field, int threads, const py::object& progress) {
  if (threads < 0) throw Error(ErrorKind::option, "threads", "expected 0, for all, or more");
  const Jumps found = resultOf(progress, [&](const Progress& link) { return findJumps(field, threads, link); });
  py::array_t<JumpRow> rows(static_cast<py::ssize_t>(found.interfaces.size()));
  std::ranges::transform(found.interfaces, rows.mutable_data(), rowOf);
  return rows;
}

}  // namespace

void addJumps(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(JumpRow, degrees, depths, axis, rms, max, gradient_rms, gradient_max, area, center, worst);
  module.def(
      "jumps", &jumps, "field"_a, py::kw_only(), "threads"_a = 0, "progress"_a = py::none(),
      "Measures the jumps of a field on the faces that neighbouring cells share, as a structured array with a "
      "row for each face.\n\n"
      "degrees and depths: of the cells on the lower and on the upper side. axis: 0, 1 or 2, normal to the face. "
      "rms and max: the jump of the value, in units of length. gradient_rms and gradient_max: the length of the "
      "jump of the gradient. area, in squared units; center of the face; worst: the point where the value jumps "
      "most.");
}

}  // namespace hpsdf::python
