// Exact distances by CGAL's AABB tree with a kernel of plain doubles instead of exact arithmetic.

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>

#include <cmath>
#include <vector>

#include "contour_scene.h"
#include "peer_points.h"

namespace hpsdf::bench {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 toPoint(const Vector3& x) { return {x.x(), x.y(), x.z()}; }

Triangles toTriangles(const TriangleMesh& mesh) {
  Triangles triangles;
  for (const auto& [a, b, c] : mesh.triangles)
    triangles.emplace_back(toPoint(mesh.vertices[a]), toPoint(mesh.vertices[b]), toPoint(mesh.vertices[c]));
  return triangles;
}

void uniform(benchmark::State& state) {
  static const Triangles triangles = toTriangles(bunny());
  static Tree tree(triangles.begin(), triangles.end());
  tree.accelerate_distance_queries();
  const std::vector<Vector3> points = uniformPoints(kUniformPoints);
  std::vector<double> out(points.size());
  timeEach(state, points.size(), [&] {
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = std::sqrt(tree.squared_distance(toPoint(points[i])));
  });
  for (std::size_t i = 0; i < points.size(); ++i)
    if (std::abs(std::abs(bunnyDistance()(points[i])) - out[i]) > 1e-9) state.SkipWithError("wrong distances");
}

using ExactMesh = CGAL::Surface_mesh<CGAL::Exact_predicates_inexact_constructions_kernel::Point_3>;

ExactMesh toExactMesh(const TriangleMesh& made) {
  ExactMesh mesh;
  std::vector<ExactMesh::Vertex_index> vertices;
  for (const Vector3& x : made.vertices) vertices.push_back(mesh.add_vertex({x.x(), x.y(), x.z()}));
  for (const auto& [a, b, c] : made.triangles) mesh.add_face(vertices[a], vertices[b], vertices[c]);
  return mesh;
}

/// Reports how many of the meshes intersect themselves, by CGAL's own test with exact predicates, and how many are not
/// closed manifolds for CGAL, which adds no face that would make a mesh non-manifold.
void countDefects(benchmark::State& state, const std::vector<TriangleMesh>& meshes) {
  int defects = 0;
  for ([[maybe_unused]] auto _ : state) {
    defects = 0;
    for (const TriangleMesh& made : meshes) {
      const ExactMesh mesh = toExactMesh(made);
      const bool isClosed = CGAL::is_closed(mesh) && mesh.number_of_faces() == made.triangles.size();
      defects += int(CGAL::Polygon_mesh_processing::does_self_intersect(mesh)) + int(!isClosed);
    }
  }
  state.counters["defects"] = defects;
  state.counters["meshes"] = double(meshes.size());
}

void crossingsOfContour(benchmark::State& state) {
  countDefects(state, {contour(contourField(), kContourOptions).mesh});
}

void crossingsOfCombinations(benchmark::State& state) { countDefects(state, combinedContours()); }

BENCHMARK(crossingsOfContour)->Name("contour/crossings/cgal")->Iterations(1);
BENCHMARK(crossingsOfCombinations)->Name("contour/combinations/cgal")->Iterations(1);
BENCHMARK(uniform)->Name("distance/uniform/cgal");

}  // namespace
}  // namespace hpsdf::bench
