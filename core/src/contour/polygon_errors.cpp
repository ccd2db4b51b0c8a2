#include "contour/polygon_errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "contour/cells/triangle_errors.h"
#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

constexpr std::size_t kTrianglesAtOnce = 64;

/// Triangles are hardly larger than the cells around them, whose samples see what the points of a triangle do not.
constexpr double kAnySpacing = std::numeric_limits<double>::infinity();

}  // namespace

void measurePolygons(const ImplicitSurface& surface, const DualMesh& mesh, bool isOpen, double tolerance,
                     const Progress& progress, std::span<CrossedEdge> edges) {
  const auto edgeOf = [&](std::uint32_t n) -> CrossedEdge& { return edges[mesh.edgeOfTriangle[n]]; };
  std::vector<std::uint32_t> changed;
  for (std::uint32_t n = 0; n < mesh.triangles.size(); ++n)
    if (edgeOf(n).polygon.isChanged) changed.push_back(n);
  std::vector<double> errors(changed.size());
  detail::forEachChunk(changed.size(), kTrianglesAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
    progress.throwIfCancelled();
    std::vector<std::array<Vector3, 3>> triangles;
    for (std::size_t i = first; i < first + count; ++i) {
      const Triangle& t = mesh.triangles[changed[i]];
      triangles.push_back({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]});
    }
    const std::span found = std::span(errors).subspan(first, count);
    raiseErrors([&](auto points, auto values) { surface.values(points, values); }, triangles, tolerance, kAnySpacing,
                found);
    for (std::size_t i = 0; isOpen && i < count; ++i)
      if (!surface.isAtWall(edgeOf(changed[first + i]).point))
        raiseErrors([&](auto points, auto values) { surface.valuesWithoutWall(points, values); },
                    std::span(triangles).subspan(i, 1), tolerance, kAnySpacing, found.subspan(i, 1));
  });
  for (const std::uint32_t n : changed) edgeOf(n).polygon.error = 0;
  for (std::size_t i = 0; i < changed.size(); ++i) {
    double& error = edgeOf(changed[i]).polygon.error;
    error = std::max(error, errors[i]);
  }
}

}  // namespace hpsdf::contouring
