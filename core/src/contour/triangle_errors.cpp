#include "contour/triangle_errors.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

constexpr std::size_t kTrianglesAtOnce = 128;
constexpr std::size_t kPointsOfTriangle = 4;

/// Sets the errors of at most kTrianglesAtOnce triangles, of which the first has the number `first`.
void findErrors(const ImplicitSurface& surface, const DualMesh& mesh, std::span<const CrossedEdge> edges, bool isOpen,
                std::size_t first, std::span<double> errors) {
  std::array<Vector3, kPointsOfTriangle * kTrianglesAtOnce> memory;
  std::array<double, kPointsOfTriangle * kTrianglesAtOnce> values;
  const std::span points = std::span(memory).first(kPointsOfTriangle * errors.size());
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const Triangle& t = mesh.triangles[first + i];
    const Vector3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    points[4 * i] = (a + b + c) / 3;
    points[4 * i + 1] = (a + b) / 2;
    points[4 * i + 2] = (b + c) / 2;
    points[4 * i + 3] = (c + a) / 2;
  }
  const auto raise = [&](std::size_t i) {
    for (std::size_t k = 0; k < kPointsOfTriangle; ++k)
      errors[i] = std::max(errors[i], std::abs(values[kPointsOfTriangle * i + k]));
  };
  surface.values(points, std::span(values).first(points.size()));
  for (std::size_t i = 0; i < errors.size(); ++i) raise(i);
  if (!isOpen) return;
  surface.valuesWithoutWall(points, std::span(values).first(points.size()));
  for (std::size_t i = 0; i < errors.size(); ++i)
    if (!surface.isAtWall(edges[mesh.edgeOfTriangle[first + i]].point)) raise(i);
}

}  // namespace

std::vector<double> findTriangleErrors(const ImplicitSurface& surface, const DualMesh& mesh,
                                       std::span<const CrossedEdge> edges, bool isOpen, const Progress& progress) {
  std::vector<double> errors(mesh.triangles.size());
  detail::forEachChunk(errors.size(), kTrianglesAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
    progress.throwIfCancelled();
    findErrors(surface, mesh, edges, isOpen, first, std::span(errors).subspan(first, count));
  });
  return errors;
}

}  // namespace hpsdf::contouring
