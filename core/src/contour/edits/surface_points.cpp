#include "contour/edits/surface_points.h"

#include <cstddef>
#include <cstdint>

#include "contour/cells/projection.h"
#include "contour/cells/triangle_errors.h"
#include "util/chunks.h"

namespace hpsdf::contouring {

std::vector<SurfacePoint> surfacePointsNear(const ImplicitSurface& surface, const EditLimits& limits,
                                            std::span<const Corners> triangles) {
  std::vector<Vector3> moved;
  std::vector<std::uint32_t> triangleOf;
  for (std::uint32_t n = 0; n < triangles.size(); ++n) {
    const auto& [a, b, c] = triangles[n];
    for (const Vector3& place : placesInTriangle(triangles[n], limits.spacing)) {
      moved.emplace_back(place[0] * a + place[1] * b + place[2] * c);
      triangleOf.push_back(n);
    }
  }
  std::vector<double> magnitudes(moved.size());
  projectOntoSurface(surface, limits.accuracy, moved, magnitudes);
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
        std::vector<Corners> corners;
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
