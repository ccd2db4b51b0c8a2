#include "samples.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "convert/arrays.h"
#include "convert/waiting.h"
#include "hpsdf/output/sample_points.h"
#include "mesh.h"

namespace py = pybind11;
using namespace py::literals;

namespace hpsdf::python {
namespace {

Doubles arrayOfVectors(std::span<const Vector3> vectors) {
  return Doubles({static_cast<py::ssize_t>(vectors.size()), py::ssize_t{3}},
                 reinterpret_cast<const double*>(vectors.data()));
}

/// Returns an array of the numbers of a list, converted to `Number`.
template <typename Number, typename Item>
py::array_t<Number> arrayOfNumbers(const std::vector<Item>& items) {
  py::array_t<Number> array(static_cast<py::ssize_t>(items.size()));
  std::ranges::transform(items, array.mutable_data(), [](Item item) { return static_cast<Number>(item); });
  return array;
}

/// The class of the results of `sample`, a named tuple of Python.
py::object& samplesClass() {
  static auto* made = new py::object(newNamedTuple(
      "Samples", py::make_tuple("points", "distances", "gradients", "kinds", "closest", "faces", "normals")));
  return *made;  // never destroyed, because the interpreter may end first
}

/// Returns samples of a mesh, of the exact distance of `mesh`, or of a field on `mesh` or on its contour.
SamplePoints samplesFrom(const py::object& source, const py::object& mesh, const SamplePointsOptions& options,
                         const py::object& progress) {
  const auto onMesh = [&](const auto& distance) {
    const auto surface = meshOf(mesh);
    return resultOf(progress, [&](const Progress& link) { return samplePoints(*surface, distance, options, link); });
  };
  const bool hasMesh = !mesh.is_none();
  if (py::isinstance<Field>(source)) {
    const auto& field = source.cast<const Field&>();
    if (hasMesh) return onMesh(field);
    return resultOf(progress, [&](const Progress& link) { return samplePoints(field, options, link); });
  }
  if (py::isinstance<ExactDistance>(source)) {
    if (!hasMesh) throw py::type_error("mesh: give the mesh from which the exact distance was made");
    return onMesh(source.cast<const ExactDistance&>());
  }
  if (!isMesh(source))
    throw py::type_error(
        "source: expected a TriangleMesh, an object with .vertices and .faces, an ExactDistance or a Field, got '" +
        std::string(py::str(py::type::of(source).attr("__name__"))) + "'");
  if (hasMesh) throw py::type_error("mesh: expected none, because the source is a mesh itself");
  const auto surface = meshOf(source);
  return resultOf(progress, [&](const Progress& link) {
    return samplePoints(*surface, ExactDistance(*surface, {.threads = options.threads}, link), options, link);
  });
}

/// Returns a number of points. Raises `OptionError` for one below 0.
std::size_t countFrom(std::int64_t count, const char* kind) {
  if (count < 0) throw Error(ErrorKind::option, kind, "expected a number of points from 0");
  return static_cast<std::size_t>(count);
}

py::object sample(const py::object& source, const py::object& mesh, std::int64_t onSurface, std::int64_t onEdges,
                  std::int64_t near, std::int64_t uniform, const std::array<double, 2>& widths, double sharpAngle,
                  double enlargement, bool floatPoints, std::uint64_t seed, int threads, const py::object& progress) {
  if (threads < 0) throw Error(ErrorKind::option, "threads", "expected 0, for all, or more");
  const SamplePoints samples = samplesFrom(source, mesh,
                                           {.surface = countFrom(onSurface, "surface"),
                                            .edge = countFrom(onEdges, "edge"),
                                            .near = countFrom(near, "near"),
                                            .uniform = countFrom(uniform, "uniform"),
                                            .widths = widths,
                                            .sharpAngleDegrees = sharpAngle,
                                            .enlargement = enlargement,
                                            .floatPoints = floatPoints,
                                            .seed = seed,
                                            .threads = threads},
                                           progress);
  return samplesClass()(arrayOfVectors(samples.points), arrayOfNumbers<double>(samples.distances),
                        arrayOfVectors(samples.gradients), arrayOfNumbers<std::uint8_t>(samples.kinds),
                        arrayOfVectors(samples.closest), arrayOfNumbers<std::int64_t>(samples.faces),
                        arrayOfVectors(samples.normals));
}

}  // namespace

void addSamples(py::module_& module) {
  const SamplePointsOptions defaults;
  module.attr("Samples") = samplesClass();
  module.def(
      "sample", &sample, "source"_a, py::kw_only(), "mesh"_a = py::none(), "surface"_a = defaults.surface,
      "edge"_a = defaults.edge, "near"_a = defaults.near, "uniform"_a = defaults.uniform, "widths"_a = defaults.widths,
      "sharp_angle"_a = defaults.sharpAngleDegrees, "enlargement"_a = defaults.enlargement,
      "float_points"_a = defaults.floatPoints, "seed"_a = defaults.seed, "threads"_a = 0, "progress"_a = py::none(),
      "Draws random points on, near and around a surface with their signed distances, for learned distance functions, "
      "as the named tuple Samples of arrays with a row for each point.\n\n"
      "source: a mesh, whose exact distances are computed; an ExactDistance, with the mesh from which it was made as "
      "`mesh`, which saves preparing it for each call; or a Field, whose points are drawn on `mesh` or, without one, "
      "on its contour, which ends where the domain does.\n"
      "surface, edge, near, uniform: the numbers of points on the surface, on its sharp edges, near it and in its "
      "enlarged box. The points depend on the seed, not on the number of threads.\n"
      "widths: the two standard deviations of near points, as shares of the surface's radius. sharp_angle: the least "
      "angle at sharp edges, in degrees. enlargement: the width added to the box on each side, as a share of the "
      "longest side. float_points: round the points to float32 before their distances are computed.\n\n"
      "points, shape (n, 3), in mesh units; distances, negative inside; gradients of the distance, unit vectors, or 0 "
      "beside a hole; kinds: 0 surface, 1 edge, 2 near, 3 uniform; closest: the closest points of the mesh; faces: the "
      "indices of their triangles; normals of these. Samples of a field have its own gradients, of any length, and no "
      "rows of closest, faces and normals. Of a "
      "shell, points are drawn on its middle surface, where distances are minus half of the thickness.\n\n"
      "Raises Error for options out of range, MeshError (a ValueError) and LimitError (a MemoryError).");
}

}  // namespace hpsdf::python
