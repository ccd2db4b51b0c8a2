#include <algorithm>
#include <cstdint>
#include <string>

#include "arguments.h"
#include "call.h"
#include "handles.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/mesh_file.h"

using namespace hpsdf;

namespace hpsdf::c {
namespace {

static_assert(sizeof(Triangle) == 3 * sizeof(std::uint32_t), "an array of n times three indices is one of n triangles");

/// Throws `Error` for the first index that is out of range. Unlike that of `requireValidIndices`, the message counts
/// from 0, as the caller's array does.
void requireIndices(std::span<const Triangle> triangles, std::size_t vertices) {
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (const std::uint32_t vertex : triangles[t])
      if (vertex >= vertices)
        throw Error(ErrorKind::mesh, "triangles",
                    "the triangle " + std::to_string(t) + " refers to the vertex " + std::to_string(vertex) +
                        ", but the mesh has " + std::to_string(vertices) + " vertices");
}

TriangleMesh meshFrom(std::span<const Vector3> vertices, std::span<const Triangle> triangles) {
  requireMemory("a mesh of " + std::to_string(triangles.size()) + " triangles",
                double(vertices.size_bytes()) + double(triangles.size_bytes()), "simplify the mesh");
  requireIndices(triangles, vertices.size());
  return {
      .vertices = {vertices.begin(), vertices.end()}, .triangles = {triangles.begin(), triangles.end()}, .name = ""};
}

}  // namespace
}  // namespace hpsdf::c

hpsdf_status hpsdf_mesh_new(const double* vertices, size_t vertex_count, const uint32_t* triangles,
                            size_t triangle_count, hpsdf_mesh** mesh) {
  return c::create(mesh, "mesh", [&] {
    return c::meshFrom(c::vectorsOf(vertices, vertex_count, "vertices"),
                       c::arrayOf(reinterpret_cast<const Triangle*>(triangles), triangle_count, "triangles"));
  });
}

hpsdf_status hpsdf_mesh_load(const char* file, const hpsdf_progress* progress, hpsdf_mesh** mesh) {
  return c::create(mesh, "mesh", [&] {
    c::requirePointer(file, "file");
    return loadMesh(file, c::progressOf(progress));
  });
}

hpsdf_status hpsdf_mesh_cleaned(const hpsdf_mesh* mesh, hpsdf_mesh** cleaned) {
  return c::create(cleaned, "cleaned", [&] {
    c::requirePointer(mesh, "mesh");
    return hpsdf::cleaned(mesh->mesh).mesh;
  });
}

size_t hpsdf_mesh_vertex_count(const hpsdf_mesh* mesh) { return mesh == nullptr ? 0 : mesh->mesh.vertices.size(); }

size_t hpsdf_mesh_triangle_count(const hpsdf_mesh* mesh) { return mesh == nullptr ? 0 : mesh->mesh.triangles.size(); }

const double* hpsdf_mesh_vertices(const hpsdf_mesh* mesh) {
  return mesh == nullptr ? nullptr : reinterpret_cast<const double*>(mesh->mesh.vertices.data());
}

const uint32_t* hpsdf_mesh_triangles(const hpsdf_mesh* mesh) {
  return mesh == nullptr ? nullptr : reinterpret_cast<const uint32_t*>(mesh->mesh.triangles.data());
}

void hpsdf_mesh_free(hpsdf_mesh* mesh) { delete mesh; }
