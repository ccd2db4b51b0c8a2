#include "field/build/automatic_strategy.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "mesh/connectivity.h"

namespace hpsdf::detail {
namespace {

/// Measures of a surface: its area, and the total lengths of the edges between two triangles whose normals differ by
/// more than 15° and 60°.
struct SurfaceMeasures {
  double area = 0, bentBy15 = 0, bentBy60 = 0;
};

SurfaceMeasures measuresOf(const TriangleSearch& search) {
  const auto vertices = search.vertices();
  const auto triangles = search.triangles();
  const double cosine15 = std::cos(std::numbers::pi / 12), cosine60 = 0.5;
  SurfaceMeasures measures;
  std::vector<Vector3> normals;
  normals.reserve(triangles.size());
  for (const auto& [a, b, c] : triangles) {
    const Vector3 normal = (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]);
    measures.area += normal.norm() / 2;
    normals.push_back(normal.normalized());
  }
  const auto edges = mesh::directedEdgesOf(triangles);
  mesh::forEachEdge(edges, [&](std::span<const mesh::DirectedEdge> around) {
    if (around.size() != 2) return;
    const Vector3 &first = normals[around[0].face], &second = normals[around[1].face];
    if (first.isZero() || second.isZero()) return;  // a triangle without area
    const bool areAlike = around[0].rising != around[1].rising;
    const double cosine = areAlike ? first.dot(second) : -first.dot(second);
    const double length = (vertices[around[0].high()] - vertices[around[0].low()]).norm();
    if (cosine < cosine15) measures.bentBy15 += length;
    if (cosine < cosine60) measures.bentBy60 += length;
  });
  return measures;
}

}  // namespace

Strategy automaticStrategy(const TriangleSearch* search, const BuildOptions& options, double referenceLength) {
  constexpr double kMostTriangles = 30'000;
  if (search == nullptr || !search->hasSigns() || options.maxBytes || options.maxSteps) return Strategy::hp;
  const SurfaceMeasures measures = measuresOf(*search);
  const auto count = double(search->triangles().size());
  const double radius = options.exactWithin * referenceLength;
  const bool isDense = count * std::numbers::pi * radius * radius > measures.area * double(options.exactTriangles) / 2;
  const bool isPart = measures.bentBy60 > referenceLength / 2 && measures.bentBy60 > measures.bentBy15 / 4;
  const bool isCoarse = count <= kMostTriangles && measures.bentBy15 > 5 * referenceLength;
  return !isDense && (isPart || isCoarse) ? Strategy::hpx : Strategy::hp;
}

}  // namespace hpsdf::detail
