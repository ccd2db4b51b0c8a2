#include "mesh/scan/mesh_builder.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "hpsdf/detail/memory.h"
#include "hpsdf/error.h"
#include "mesh/scan/triangulate.h"

namespace hpsdf::mesh {
namespace {

constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();

std::string lineText(std::uint64_t line) { return line > 0 ? "line " + std::to_string(line) + ": " : ""; }

void requireBytes(double bytes) { requireMemory("a mesh of this size", bytes, "simplify the mesh first"); }

}  // namespace

MeshBuilder::MeshBuilder(const Input& input) : input_(input) { mesh_.name = input.file().string(); }

void MeshBuilder::expect(std::uint64_t count, std::uint64_t bytes, const char* what) const {
  if (count > input_.mostLeft() / bytes)
    input_.refuse("its header promises " + std::to_string(count) + " " + what + ", but only " +
                  std::to_string(input_.mostLeft()) + " bytes follow; export it again");
  if (count > kMost)
    throw Error(ErrorKind::limit, mesh_.name,
                "more than " + std::to_string(kMost) + " " + what + "; simplify the mesh first");
}

void MeshBuilder::expectVertices(std::uint64_t count, std::uint64_t bytes) {
  expect(count, bytes, "vertices");
  requireBytes(double(vertices() + count) * sizeof(Vector3));
  mesh_.vertices.reserve(vertices() + count);
}

void MeshBuilder::expectTriangles(std::uint64_t count, std::uint64_t bytes) {
  expect(count, bytes, "faces");
  requireBytes(double(arrayBytes()) + double(count) * sizeof(Triangle));
  mesh_.triangles.reserve(mesh_.triangles.size() + count);
}

std::size_t MeshBuilder::arrayBytes() const {
  return mesh_.vertices.capacity() * sizeof(Vector3) + mesh_.triangles.capacity() * sizeof(Triangle) +
         later_.capacity() * sizeof(LaterFace) + laterCorners_.capacity() * sizeof(std::uint32_t);
}

/// Makes room for more elements: for as many as the rest of the file will hold if it goes on like the part that has
/// been read since the first of them. Memory that is never written to is not taken from the machine.
template <typename T>
void MeshBuilder::grow(std::vector<T>& array, double& beginning) const {
  constexpr std::size_t kFirst = 1024;
  constexpr double kReserve = 1.02;
  const std::size_t size = array.size();
  if (size >= kMost)
    throw Error(ErrorKind::limit, mesh_.name,
                "more than " + std::to_string(kMost) + " vertices or triangles; simplify the mesh first");
  const double share = input_.share();
  if (beginning < 0) beginning = share;
  const double read = share - beginning;
  const std::size_t least = std::max(kFirst, size + size / 4);
  requireBytes(double(arrayBytes()) + double(least) * sizeof(T));  // old and new array exist together
  std::size_t capacity = std::max(least, 2 * size);
  if (read > 0) {
    const double whole = kReserve * double(size) / read * (1 - beginning);
    capacity = std::max(least, std::size_t(std::min(whole, double(kMost))));
  }
  if (double(arrayBytes()) + double(capacity) * sizeof(T) > allowedMemory()) capacity = least;
  array.reserve(capacity);
}

void MeshBuilder::growVertices() { grow(mesh_.vertices, verticesBegin_); }
void MeshBuilder::growTriangles() { grow(mesh_.triangles, trianglesBegin_); }

void MeshBuilder::addPolygon(std::span<const std::uint32_t> corners, std::uint64_t line) {
  ++faces_;
  if (corners.size() < 3) return;
  constexpr double kBytesACorner = 200;  // of the polygon's triangulation
  requireBytes(double(arrayBytes()) + kBytesACorner * double(corners.size()));
  const auto isKnown = [&](std::uint32_t v) { return v < vertices(); };
  std::ranges::all_of(corners, isKnown) ? addTriangulated(corners) : addLater(corners, line);
}

void MeshBuilder::addLater(std::span<const std::uint32_t> corners, std::uint64_t line) {
  constexpr std::size_t kBetweenChecks = 1 << 16;
  if (later_.size() % kBetweenChecks == 0) requireBytes(3.0 * double(arrayBytes()));  // the arrays may double
  later_.push_back({laterCorners_.size(), corners.size(), faces_, line});
  laterCorners_.insert(laterCorners_.end(), corners.begin(), corners.end());
}

void MeshBuilder::addTriangulated(std::span<const std::uint32_t> corners) {
  polygon_.clear();
  for (const std::uint32_t v : corners) polygon_.push_back(mesh_.vertices[v]);
  for (const auto& [a, b, c] : triangulate(polygon_, input_.progress())) {
    if (mesh_.triangles.size() == mesh_.triangles.capacity()) growTriangles();
    mesh_.triangles.push_back({corners[a], corners[b], corners[c]});
  }
}

void MeshBuilder::refuseVertexOf(std::uint64_t face, std::int64_t vertex, std::uint64_t line) const {
  throw Error(ErrorKind::mesh, mesh_.name,
              lineText(line) + "face " + std::to_string(face) + " refers to vertex " + std::to_string(vertex) +
                  ", but there are only " + std::to_string(vertices()) + "; repair or export the mesh again");
}

void MeshBuilder::refuseVertex(std::int64_t vertex, std::uint64_t line) const {
  refuseVertexOf(faces_ + 1, vertex, line);
}

void MeshBuilder::refuseNegative(std::int64_t index, std::uint64_t line) const {
  throw Error(ErrorKind::mesh, mesh_.name,
              lineText(line) + "face " + std::to_string(faces_ + 1) + " has a negative index, " +
                  std::to_string(index) + "; repair or export the mesh again");
}

TriangleMesh MeshBuilder::finish() {
  for (const LaterFace& face : later_) {
    const auto corners = std::span(laterCorners_).subspan(face.firstCorner, face.corners);
    for (const std::uint32_t v : corners)
      if (v >= vertices()) refuseVertexOf(face.number, std::int64_t{v} + 1, face.line);
    addTriangulated(corners);
  }
  later_.clear();
  return std::move(mesh_);
}

}  // namespace hpsdf::mesh
