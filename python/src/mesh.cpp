#include "mesh.h"

#include <pybind11/stl/filesystem.h>

#include <cmath>
#include <string>

#include "convert/arrays.h"
#include "convert/waiting.h"
#include "hpsdf/mesh_file.h"

namespace py = pybind11;
using namespace py::literals;

namespace hpsdf::python {
namespace {

using WholeNumbers = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;

std::vector<Vector3> verticesOf(const py::handle& argument) {
  const Points points(argument, "vertices");
  if (points.shape().size() != 1)
    throw py::value_error("vertices: expected an array of shape (n, 3), got " + shapeText(points.shape({3})));
  for (std::size_t i = 0; i < points.count(); ++i)
    if (!points.all()[i].allFinite())
      throw Error(ErrorKind::mesh, "vertices", "row " + std::to_string(i) + " is not finite");
  return {points.all().begin(), points.all().end()};
}

std::vector<Triangle> trianglesOf(const py::handle& argument, std::size_t vertices) {
  const auto array = py::array::ensure(argument);
  if (!array) throw py::error_already_set();
  const char kind = array.dtype().kind();
  if (kind != 'i' && kind != 'u')
    throw py::type_error("triangles: expected an array of whole numbers, got one of " +
                         std::string(py::str(array.dtype())));
  if (array.ndim() != 2 || array.shape(1) != 3)
    throw py::value_error("triangles: expected an array of shape (n, 3), got " +
                          shapeText({array.shape(), array.shape() + array.ndim()}));
  const auto numbers = WholeNumbers::ensure(array);
  if (!numbers) throw py::error_already_set();
  std::vector<Triangle> triangles(static_cast<std::size_t>(array.shape(0)));
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::int64_t index = numbers.data()[3 * i + corner];
      if (index < 0 || static_cast<std::size_t>(index) >= vertices)
        throw Error(ErrorKind::mesh, "triangles",
                    "row " + std::to_string(i) + " refers to the vertex " + std::to_string(index) +
                        ", but the mesh has " + std::to_string(vertices) + " vertices");
      triangles[i][corner] = static_cast<std::uint32_t>(index);
    }
  return triangles;
}

std::shared_ptr<TriangleMesh> meshFrom(const py::object& vertices, const py::object& triangles,
                                       const std::string& name) {
  auto mesh = std::make_shared<TriangleMesh>();
  mesh->vertices = verticesOf(vertices);
  mesh->triangles = trianglesOf(triangles, mesh->vertices.size());
  mesh->name = name;
  return mesh;
}

/// Returns a read-only array of `rows` rows of three numbers that refers to the memory of `owner`.
template <typename Number>
py::array viewOf(const Number* numbers, std::size_t rows, const py::object& owner) {
  py::array_t<Number> view({static_cast<py::ssize_t>(rows), py::ssize_t{3}}, numbers, owner);
  view.attr("flags").attr("writeable") = false;
  return view;
}

py::array vertexView(const py::object& self) {
  const auto& mesh = self.cast<const TriangleMesh&>();
  return viewOf(reinterpret_cast<const double*>(mesh.vertices.data()), mesh.vertices.size(), self);
}

py::array triangleView(const py::object& self) {
  const auto& mesh = self.cast<const TriangleMesh&>();
  return viewOf(reinterpret_cast<const std::uint32_t*>(mesh.triangles.data()), mesh.triangles.size(), self);
}

std::shared_ptr<TriangleMesh> loadedMesh(const std::filesystem::path& path, const py::object& progress) {
  return std::make_shared<TriangleMesh>(
      resultOf(progress, [&](const Progress& link) { return loadMesh(path.string(), link); }));
}

std::shared_ptr<TriangleMesh> cleanedCopy(const TriangleMesh& mesh) {
  return std::make_shared<TriangleMesh>(resultOf(py::none(), [&](const Progress&) { return cleaned(mesh).mesh; }));
}

}  // namespace

bool isMesh(const py::handle& object) {
  return py::isinstance<TriangleMesh>(object) || (py::hasattr(object, "vertices") && py::hasattr(object, "faces"));
}

std::shared_ptr<const TriangleMesh> meshOf(const py::object& object) {
  if (py::isinstance<TriangleMesh>(object)) return object.cast<std::shared_ptr<TriangleMesh>>();
  if (!isMesh(object))
    throw py::type_error("mesh: expected a TriangleMesh or an object with .vertices and .faces, got '" +
                         std::string(py::str(py::type::of(object).attr("__name__"))) + "'");
  return meshFrom(object.attr("vertices"), object.attr("faces"), "");
}

void addMesh(py::module_& module) {
  py::class_<TriangleMesh, std::shared_ptr<TriangleMesh>>(
      module, "TriangleMesh",
      "A triangle mesh: vertices in mesh units, and triangles that refer to the vertices by index.\n\n"
      "Meshes are immutable. Vertices of equal position count as different ones, as in the arrays; `cleaned` joins "
      "them.")
      .def(py::init(&meshFrom), "vertices"_a, "triangles"_a, "name"_a = "",
           "Makes a mesh from an array of shape (n, 3) of real numbers and one of shape (m, 3) of whole numbers, whose "
           "rows are counter-clockwise as seen from outside. Both are copied.\n\n"
           "Raises MeshError (a ValueError) for vertices that are not finite and for indices out of range, ValueError "
           "for other shapes and TypeError for other types of numbers.")
      .def_property_readonly("vertices", &vertexView, "The vertices: read-only, float64, shape (n, 3), in mesh units.")
      .def_property_readonly("triangles", &triangleView,
                             "The indices of the triangles' vertices: read-only, uint32, shape (m, 3).")
      .def_property_readonly("faces", &triangleView, "The same as `triangles`.")
      .def_readonly("name", &TriangleMesh::name, "The file's name without its path, or a shape's specification.")
      .def("cleaned", &cleanedCopy,
           "Returns a copy for distance queries: vertices of equal position are joined, degenerate and duplicate "
           "triangles and unused vertices are dropped, and the mesh is reversed if its volume is negative.\n\n"
           "Raises MeshError if no triangle with an area is left.")
      .def(
          "save",
          [](const TriangleMesh& mesh, const std::filesystem::path& path) {
            const py::gil_scoped_release released;
            saveMesh(mesh, path);
          },
          "path"_a, "Writes the mesh as .obj, .ply, .stl or .glb. Raises FileError (an OSError).")
      .def("__repr__",
           [](const TriangleMesh& mesh) {
             return "<hpsdf.TriangleMesh: " + std::to_string(mesh.vertices.size()) + " vertices, " +
                    std::to_string(mesh.triangles.size()) + " triangles>";
           })
      .def(py::pickle(
          [](const py::object& self) {
            return py::make_tuple(vertexView(self), triangleView(self), self.attr("name"));
          },
          [](const py::tuple& state) { return meshFrom(state[0], state[1], state[2].cast<std::string>()); }));
  module.def(
      "load_mesh", &loadedMesh, "path"_a, py::kw_only(), "progress"_a = py::none(),
      "Reads a mesh file (.obj, .ply, .stl, .off, .gltf, .glb or .3ds) and cleans the mesh, or returns that of a "
      "built-in shape such as 'builtin:torus'.\n\n"
      "Raises FileError (an OSError) or MeshError (a ValueError). A damaged .3ds file, or a .glb file that Draco "
      "has compressed, can crash the libraries that read them: read untrusted ones in another process.");
}

}  // namespace hpsdf::python
