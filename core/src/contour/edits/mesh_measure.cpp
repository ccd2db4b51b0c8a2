#include <algorithm>
#include <cmath>
#include <vector>

#include "contour/cells/triangle_errors.h"
#include "contour/edits/improvement.h"
#include "util/chunks.h"

namespace hpsdf::contouring {

MeshErrors measure(const ImplicitSurface& surface, const EditLimits& limits, const Progress& progress,
                   const EditedMesh& mesh) {
  constexpr std::size_t kAtOnce = 64;
  const std::size_t triangles = mesh.triangles().size();
  std::vector<double> values(triangles), squaredGaps(triangles);
  detail::forEachChunk(triangles, kAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
    progress.throwIfCancelled();
    std::vector<Corners> corners;
    for (std::size_t n = first; n < first + count; ++n) {
      corners.push_back(mesh.corners(static_cast<std::uint32_t>(n)));
      const NearTriangles triangle({&corners.back(), 1});
      mesh.forEachPointOf(static_cast<std::uint32_t>(n),
                          [&](const Vector3& point) { triangle.raise(squaredGaps[n], point); });
    }
    raiseErrors([&](auto points, auto found) { surface.values(points, found); }, corners, limits.tolerance,
                limits.spacing, std::span(values).subspan(first, count));
  });
  if (triangles == 0) return {};
  MeshErrors errors{std::ranges::max(values), std::sqrt(std::ranges::max(squaredGaps)), 0};
  for (std::size_t n = 0; n < triangles; ++n)
    if (values[n] > limits.tolerance || squaredGaps[n] > limits.tolerance * limits.tolerance) ++errors.missed;
  return errors;
}

}  // namespace hpsdf::contouring
