#include "contour/edits/surface_points.h"

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "contour/cells/triangle_errors.h"
#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

/// Moves points along the gradient towards the surface, and returns the magnitudes of the function there.
std::vector<double> moveToSurface(const ImplicitSurface& surface, double accuracy, std::span<Vector3> points) {
  constexpr int kSteps = 4;
  std::vector<ValueAndGradient> found(points.size());
  std::vector<double> magnitudes(points.size());
  for (int step = 0; step <= kSteps; ++step) {
    surface.valuesAndGradients(points, found);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto& [value, gradient] = found[i];
      magnitudes[i] = std::abs(value);
      const double squared = gradient.squaredNorm();
      if (magnitudes[i] > accuracy && step < kSteps && squared > 0.01) points[i] -= gradient * (value / squared);
    }
  }
  return magnitudes;
}

}  // namespace

std::vector<SurfacePoint> surfacePointsNear(const ImplicitSurface& surface, const EditLimits& limits,
                                            std::span<const std::array<Vector3, 3>> triangles) {
  std::vector<Vector3> moved;
  std::vector<std::uint32_t> triangleOf;
  for (std::uint32_t n = 0; n < triangles.size(); ++n) {
    const auto& [a, b, c] = triangles[n];
    for (const Vector3& place : placesInTriangle(triangles[n], limits.spacing)) {
      moved.emplace_back(place[0] * a + place[1] * b + place[2] * c);
      triangleOf.push_back(n);
    }
  }
  const std::vector<double> magnitudes = moveToSurface(surface, limits.accuracy, moved);
  std::vector<SurfacePoint> points;
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const double squared = NearTriangles(triangles.subspan(triangleOf[i], 1)).nearestTo(moved[i]).second;
    if (magnitudes[i] <= limits.accuracy && squared <= limits.tolerance * limits.tolerance)
      points.push_back({moved[i], triangleOf[i]});
  }
  return points;
}

std::vector<SurfacePoint> surfacePointsOf(const ImplicitSurface& surface, const EditLimits& limits,
                                          const Progress& progress, const EditedMesh& mesh) {
  constexpr std::size_t kAtOnce = 64;
  std::vector<SurfacePoint> points = detail::listOfChunks<SurfacePoint>(
      mesh.triangles().size(), kAtOnce, Progress{.report = {}, .cancelled = progress.cancelled}, "",
      [&](std::vector<SurfacePoint>& found, std::size_t first, std::size_t count) {
        std::vector<std::array<Vector3, 3>> corners;
        for (std::size_t n = first; n < first + count; ++n)
          corners.push_back(mesh.corners(static_cast<std::uint32_t>(n)));
        found = surfacePointsNear(surface, limits, corners);
        for (SurfacePoint& point : found) point.triangle += static_cast<std::uint32_t>(first);
      });
  for (std::uint32_t vertex = 0; vertex < mesh.vertices().size(); ++vertex)
    if (!mesh.trianglesAt(vertex).empty()) points.push_back({mesh.vertices()[vertex], mesh.trianglesAt(vertex)[0]});
  return points;
}

}  // namespace hpsdf::contouring
