#include "exact_distance.h"

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "convert/arrays.h"
#include "convert/waiting.h"
#include "hpsdf/detail/nearest_name.h"
#include "mesh.h"

namespace py = pybind11;
using namespace py::literals;

namespace hpsdf::python {
namespace {

/// The words for inside tests, in the order of `InsideTest`.
const std::array<std::string, 5> kInsideTests = {"automatic", "pseudonormal", "winding", "shell", "outer_hull"};

constexpr std::size_t kPiece = 1 << 17;  // points between two looks for signals: some tenths of a second

std::shared_ptr<ExactDistance> distanceTo(const py::object& mesh, const std::string& insideTest, double thickness,
                                          int threads, const py::object& progress) {
  const auto triangles = meshOf(mesh);
  const DistanceOptions options = distanceOptions(insideTest, thickness, threads);
  return std::make_shared<ExactDistance>(
      resultOf(progress, [&](const Progress& link) { return ExactDistance(*triangles, options, link); }));
}

py::object distances(const ExactDistance& distance, const py::object& argument, const py::object& out) {
  return numberForEach(argument, out, [&](std::span<const Vector3> points, std::span<double> numbers) {
    forEachPiece(points.size(), kPiece, [&](std::size_t first, std::size_t count) {
      distance(points.subspan(first, count), numbers.subspan(first, count));
    });
  });
}

/// The class of the results of `closest`, a named tuple of Python.
py::object& closestPointsClass() {
  static auto* made =
      new py::object(newNamedTuple("ClosestPoints", py::make_tuple("distance", "point", "face", "barycentric")));
  return *made;  // never destroyed, because the interpreter may end first
}

py::object closest(const ExactDistance& distance, const py::object& argument) {
  const Points points(argument);
  Doubles signedDistance(points.shape()), point(points.shape({3})), barycentric(points.shape({3}));
  py::array_t<std::int64_t> face(points.shape());
  auto* const distanceOut = signedDistance.mutable_data();
  auto* const pointOut = reinterpret_cast<Vector3*>(point.mutable_data());
  auto* const barycentricOut = reinterpret_cast<Vector3*>(barycentric.mutable_data());
  auto* const faceOut = face.mutable_data();
  std::vector<ClosestPoint> piece(std::min(kPiece, points.count()));
  forEachPiece(points.count(), kPiece, [&](std::size_t first, std::size_t count) {
    distance.closestPoints(points.all().subspan(first, count), std::span(piece).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      distanceOut[first + i] = piece[i].signedDistance;
      pointOut[first + i] = piece[i].point;
      barycentricOut[first + i] = piece[i].barycentric;
      faceOut[first + i] = piece[i].triangle;
    }
  });
  if (signedDistance.ndim() > 0) return closestPointsClass()(signedDistance, point, face, barycentric);
  return closestPointsClass()(unwrapped(signedDistance), point, py::int_(*faceOut), barycentric);
}

}  // namespace

DistanceOptions distanceOptions(const std::string& insideTest, double thickness, int threads) {
  const auto found = std::ranges::find(kInsideTests, insideTest);
  if (found == kInsideTests.end())
    throw Error(ErrorKind::option, "inside_test",
                "there is no '" + insideTest + "': " +
                    didYouMean(insideTest, kInsideTests,
                               "expected 'automatic', 'pseudonormal', 'winding', 'shell' or 'outer_hull'"));
  return {
      .insideTest = static_cast<InsideTest>(found - kInsideTests.begin()), .thickness = thickness, .threads = threads};
}

void addExactDistance(py::module_& module) {
  module.attr("ClosestPoints") = closestPointsClass();
  py::class_<ExactDistance, std::shared_ptr<ExactDistance>>(
      module, "ExactDistance",
      "The exact signed distance to a triangle mesh in double precision, negative inside.\n\n"
      "Objects keep no reference to the mesh. Several threads may use one at the same time.")
      .def(py::init(&distanceTo), "mesh"_a, py::kw_only(), "inside_test"_a = "automatic", "thickness"_a = 0.0,
           "threads"_a = 0, "progress"_a = py::none(),
           "Prepares the distance to a TriangleMesh, or to an object with .vertices and .faces.\n\n"
           "inside_test: 'automatic'; 'pseudonormal', for closed meshes without self-intersections; 'winding', for "
           "any mesh, whose holes are closed; 'shell', a wall of the given thickness (in mesh units) around open "
           "sheets; or 'outer_hull', as 'winding' but without inner walls. threads: greatest number of threads, 0 for "
           "all. progress: as of build.\n\n"
           "Raises MeshError or OptionError, which are ValueErrors.")
      .def("__call__", &distances, "points"_a, "out"_a = py::none(),
           "Returns the signed distances of points, shape (..., 3), as an array of shape (...), or as a float for one "
           "point of shape (3,). Units are those of the mesh.\n\n"
           "out: a C-contiguous array of float64 with the shape of the result, which receives and becomes it.")
      .def("closest", &closest, "points"_a,
           "Returns the closest points of the mesh to points, shape (..., 3), as the named tuple ClosestPoints: the "
           "signed distance, shape (...); the point, shape (..., 3); the index of its face, int64, shape (...); and "
           "the barycentric coordinates of the point in this face, shape (..., 3).")
      .def_property_readonly(
          "inside_test",
          [](const ExactDistance& distance) {
            return kInsideTests[static_cast<std::size_t>(distance.insideTestChoice().insideTest)];
          },
          "The inside test that is used: never 'automatic'.");
}

}  // namespace hpsdf::python
