#include <algorithm>
#include <cmath>
#include <vector>

#include "contour/cells/triangle_errors.h"
#include "contour/edits/improvement.h"
#include "util/chunks.h"

namespace hpsdf::contouring {

MeshErrors measure(const ImplicitSurface& surface, double tolerance, const Progress& progress, const EditedMesh& mesh) {
  constexpr std::size_t kAtOnce = 64;
  const std::size_t triangles = mesh.triangles().size();
  std::vector<double> values(triangles), squaredGaps(triangles);
  detail::forEachChunk(triangles, kAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
    progress.throwIfCancelled();
    std::vector<std::array<Vector3, 3>> corners;
    for (std::size_t n = first; n < first + count; ++n) {
      corners.push_back(mesh.corners(static_cast<std::uint32_t>(n)));
      const NearTriangles triangle({&corners.back(), 1});
      for (const std::uint32_t point : mesh.pointsOf(static_cast<std::uint32_t>(n)))
        squaredGaps[n] = std::max(squaredGaps[n], triangle.nearestTo(mesh.point(point)).second);
    }
    raiseErrors([&](auto points, auto found) { surface.values(points, found); }, corners, tolerance,
                std::span(values).subspan(first, count));
  });
  if (triangles == 0) return {};
  return {std::ranges::max(values), std::sqrt(std::ranges::max(squaredGaps))};
}

}  // namespace hpsdf::contouring
