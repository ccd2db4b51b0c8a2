#include "contour/polygon_errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

constexpr std::size_t kTrianglesAtOnce = 128;
constexpr std::size_t kPointsOfTriangle = 7;

/// Sets the errors of at most kTrianglesAtOnce triangles.
void findErrors(const ImplicitSurface& surface, const DualMesh& mesh, std::span<const CrossedEdge> edges, bool isOpen,
                std::span<const std::uint32_t> triangles, std::span<double> errors) {
  std::array<Vector3, kPointsOfTriangle * kTrianglesAtOnce> memory;
  std::array<double, kPointsOfTriangle * kTrianglesAtOnce> values;
  const std::span points = std::span(memory).first(kPointsOfTriangle * triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[triangles[i]];
    const Vector3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const std::array<Vector3, kPointsOfTriangle> ofTriangle = {a,           b,           c,          (a + b + c) / 3,
                                                               (a + b) / 2, (b + c) / 2, (c + a) / 2};
    std::ranges::copy(ofTriangle, &points[kPointsOfTriangle * i]);
  }
  const auto raise = [&](std::size_t i) {
    for (std::size_t k = 0; k < kPointsOfTriangle; ++k)
      errors[i] = std::max(errors[i], std::abs(values[kPointsOfTriangle * i + k]));
  };
  surface.values(points, std::span(values).first(points.size()));
  for (std::size_t i = 0; i < triangles.size(); ++i) raise(i);
  if (!isOpen) return;
  surface.valuesWithoutWall(points, std::span(values).first(points.size()));
  for (std::size_t i = 0; i < triangles.size(); ++i)
    if (!surface.isAtWall(edges[mesh.edgeOfTriangle[triangles[i]]].point)) raise(i);
}

}  // namespace

void measurePolygons(const ImplicitSurface& surface, const DualMesh& mesh, bool isOpen, const Progress& progress,
                     std::span<CrossedEdge> edges) {
  std::vector<std::uint32_t> changed;
  for (std::uint32_t n = 0; n < mesh.triangles.size(); ++n)
    if (edges[mesh.edgeOfTriangle[n]].polygon.isChanged) changed.push_back(n);
  std::vector<double> errors(changed.size());
  detail::forEachChunk(changed.size(), kTrianglesAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
    progress.throwIfCancelled();
    findErrors(surface, mesh, edges, isOpen, std::span(changed).subspan(first, count),
               std::span(errors).subspan(first, count));
  });
  for (CrossedEdge& edge : edges)
    if (edge.polygon.isChanged) edge.polygon.error = 0;
  for (std::size_t i = 0; i < changed.size(); ++i) {
    double& error = edges[mesh.edgeOfTriangle[changed[i]]].polygon.error;
    error = std::max(error, errors[i]);
  }
}

}  // namespace hpsdf::contouring
