#include "samples.h"

#include <algorithm>
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

py::object sample(const py::object& surface, std::size_t onSurface, std::size_t onEdges, std::size_t near,
                  std::size_t uniform, std::uint64_t seed, int threads, const py::object& progress) {
  const auto mesh = meshOf(surface);
  const SamplePointsOptions options = {
      .surface = onSurface, .edge = onEdges, .near = near, .uniform = uniform, .seed = seed, .threads = threads};
  const SamplePoints samples = resultOf(progress, [&](const Progress& link) {
    return samplePoints(*mesh, ExactDistance(*mesh, {.threads = threads}, link), options, link);
  });
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
      "sample", &sample, "mesh"_a, py::kw_only(), "surface"_a = defaults.surface, "edge"_a = defaults.edge,
      "near"_a = defaults.near, "uniform"_a = defaults.uniform, "seed"_a = defaults.seed, "threads"_a = 0,
      "progress"_a = py::none(),
      "Draws random points on, near and around a mesh with their exact distances, for learned distance functions, as "
      "the named tuple Samples of arrays with a row for each point.\n\n"
      "surface, edge, near, uniform: the numbers of points on the surface, on its sharp edges, near it and in its "
      "enlarged box. The points depend on the seed, not on the number of threads.\n\n"
      "points, shape (n, 3), in mesh units; distances, negative inside; gradients of the distance, unit vectors, or 0 "
      "beside a hole; kinds: 0 surface, 1 edge, 2 near, 3 uniform; closest: the closest points of the mesh; faces: the "
      "indices of their triangles; normals of these.\n\n"
      "Raises Error for options out of range, MeshError (a ValueError) and LimitError (a MemoryError).");
}

}  // namespace hpsdf::python
